#pragma once

// The printed board of a lens calibration, and what keeps it from being found in a photograph.

#include <optional>
#include <string>
#include <vector>

#include "calibration/checkerboard.h"
#include "calibration/lens_fit.h"
#include "scene/core/result.h"
#include "scene/image/image_formats.h"

namespace daylit::calibration {

/// A checkerboard, or with a dictionary a ChArUco board: markers in its white squares, ids row by row from the top
/// left, either with a black square in the top left corner or, as OpenCV drew boards with an even number of rows
/// before 4.6, with a white one; that is told from the pictures.
struct Target {
  BoardSize size; ///< inner corners
  double square_m = 0;
  std::string dictionary{}; ///< as "6X6_250"; empty: a plain checkerboard
  double marker_m = 0;      ///< side of a marker's black square
};

/// A board in a picture. A checkerboard is found whole or not at all; of a ChArUco board any part.
struct FoundBoard {
  std::vector<glm::dvec2> corner_px; ///< subpixel; pixel centres are whole numbers; empty: not found
  std::vector<glm::dvec3> board_m;   ///< where these corners are on the board
  std::string why;                   ///< not found: the reason, and what to do
  bool white_is_lost = false;        ///< found: most of its white is at the top of the range
};

/// Error usage: unknown dictionary.
Result<FoundBoard> find_board(const Rgb8Image& picture, const Target& target);

} // namespace daylit::calibration
