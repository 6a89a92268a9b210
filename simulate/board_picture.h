#pragma once

// What a camera with blur and noise sees of a printed marker board: pictures of known pose for tracking and
// calibration.

#include <cstdint>
#include <vector>

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>

#include "capture/markers/board.h"
#include "capture/markers/find_markers.h"
#include "scene/config/config.h"
#include "scene/core/result.h"
#include "scene/image/image_formats.h"
#include "scene/lens/lens.h"

namespace daylit {

/// A board and the prints of its markers, white paper reaching `margin_m` around each of them, a grey wall behind.
struct PrintedBoard {
  BoardLayout layout;
  std::vector<MarkerPrint> prints; ///< one per marker of the layout
  double margin_m = 0.0;
  double paper = 0.75, ink = 0.04, wall = 0.2; ///< linear values of the picture, 0..1

  /// The prints of the layout's dictionary. Errors as marker_print().
  static Result<PrintedBoard> print(const BoardLayout& layout, double margin_m);
  /// The paper lies within this distance of the origin along x and y.
  glm::dvec2 half_paper() const;
  /// Linear value at a point of the board's plane, metres, board frame.
  double at(double x, double y) const;
};

struct CameraQuality {
  double blur_px = 0.7;                ///< standard deviation of the point spread beside the pixel's own area
  CameraNoise noise{0.004, 4e-5, 0.0}; ///< linear, of a sensor of 10,000 electrons and a read noise of 40 at half scale
  double uneven = 0.2;                 ///< light falls by this fraction from the left edge of the picture to the right
};

/// A camera before printed boards.
class BoardCamera {
public:
  BoardCamera(const LensModel& lens, const CameraQuality& quality);
  /// The 8-bit sRGB picture of the board; camera_from_board is rigid, metres. The board's back is wall. 16 samples per
  /// pixel. The same seed, the same noise.
  Rgb8Image picture(const PrintedBoard& board, const glm::dmat4& camera_from_board, std::uint32_t seed) const;

private:
  Rgb8Image developed(const std::vector<double>& light, std::uint32_t seed) const;

  int width_, height_;
  CameraQuality quality_;
  std::vector<glm::dvec2> ray_;    ///< with z = 1, through the corners of all pixels
  std::vector<std::uint8_t> code_; ///< of 65536 steps of light
};

} // namespace daylit
