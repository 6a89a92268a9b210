#pragma once

// A printed ArUco marker as a surface: a white sheet with one marker in its middle.

#include <array>
#include <cstdint>

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include "scene/config/config.h"
#include "scene/image/rgb_image.h"

namespace daylit {

/// Number 23 of the dictionary DICT_6X6_250 (Garrido-Jurado et al. 2014): six rows of six cells, top row first, most
/// significant bit left, 1 = white. Around them a black border of one cell.
extern const std::array<std::uint8_t, 6> kMarker23;

struct MarkerBoard {
  glm::dmat4 world_from_board{1.0}; ///< origin in the middle of the marker; x right, y up, z out of the board
  double marker_size_m = 0.1;       ///< outer side of the black border
  double margin_m = 0.025;          ///< white sheet around it
  float white_reflectance = 0.8f, black_reflectance = 0.04f;

  /// At the pose, of the size and with the white of the configuration; a margin of a quarter of the marker.
  static MarkerBoard printed(const MarkerConfig& marker);
  double half_side_m() const { return 0.5 * marker_size_m + margin_m; }
  /// Corners of the sheet, counter-clockwise seen from the front, world metres.
  std::array<glm::dvec3, 4> corners() const;
  /// Printed reflectance at a world point on the sheet.
  Rgb reflectance(const glm::dvec3& world_point) const;
};

} // namespace daylit
