#pragma once

// What is printed on paper for a calibration: boards, and a chart of colours.

#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "calibration/target.h"
#include "scene/core/result.h"
#include "scene/image/image_formats.h"

namespace daylit::calibration {

/// Rectangles on white paper, y down from the top left corner of the paper, metres. Later ones cover earlier ones.
struct BoardPrint {
  glm::dvec2 size_m{0.0};
  struct Rectangle {
    glm::dvec2 corner_m, side_m;
    Rgb colour; ///< sRGB, 0..1
  };
  std::vector<Rectangle> rectangles;
};

/// A margin of one square around the board. Errors usage: unknown dictionary, or it has too few markers.
Result<BoardPrint> board_print(const Target& target);
/// The 24 patches of the published chart on black, a white margin around it.
BoardPrint chart_print(double width_m);

std::string svg_of(const BoardPrint& print);
Rgb8Image picture_of(const BoardPrint& print, double pixels_per_metre);

} // namespace daylit::calibration
