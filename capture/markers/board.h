#pragma once

// Printed square markers on one plane, and their corners in a picture.
//
// Board frame, everywhere in daylit: x right, y up, z out of the board towards the viewer. Metres.

#include <array>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "scene/core/result.h"

namespace daylit {

/// One marker on the board, printed upright.
struct PlacedMarker {
  int id = 0;
  double side_m = 0;        ///< outer side of its black square
  glm::dvec2 centre_m{0.0}; ///< in the board frame
};

struct BoardLayout {
  std::string dictionary = "6X6_250"; ///< with or without "DICT_" in front
  std::vector<PlacedMarker> markers;  ///< several: their places on the one board are known

  /// One marker whose centre is the board's origin.
  static BoardLayout single(const std::string& dictionary, int id, double side_m);
  /// `columns` x rows markers of one size, ids row by row from the top left, `gap_m` apart; origin in the middle.
  static Result<BoardLayout> grid(const std::string& dictionary, const std::vector<int>& ids, int columns,
                                  double side_m, double gap_m);
};

/// Corners of a marker in a picture: top left, top right, bottom right, bottom left of the print, pixels, sub-pixel.
/// The print is upright as its authors publish it: ArUco markers as OpenCV draws them, AprilTags as the AprilTag
/// library has them, which is OpenCV's drawing turned by 180 degrees.
struct SeenMarker {
  int id = 0;
  std::array<glm::dvec2, 4> corner_px{};
};

/// The board positions, metres, that belong to SeenMarker::corner_px. The only function where OpenCV's order and frame
/// (y down, clockwise from the top left) meet ours (y up).
std::array<glm::dvec2, 4> board_corners(const PlacedMarker& marker);

} // namespace daylit
