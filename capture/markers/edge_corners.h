#pragma once

#include <array>
#include <vector>

#include <glm/vec2.hpp>

#include "scene/image/image_formats.h"

namespace daylit::detail {

/// Brightness of a picture, row-major, 0..1.
struct GreyImage {
  int width = 0, height = 0;
  std::vector<float> value;
  /// Bilinear; positions outside are clamped to the border.
  double at(const glm::dvec2& p) const;
};

/// Corners of a dark square on light ground (in order around it, to about a pixel) moved to the crossings of its four
/// sides, each a line fitted to the places where the brightness changes most. Unlike a corner detector's window, the
/// sides use only the outer edge of the square: the pattern inside does not pull. Precision: a few hundredths of a
/// pixel on a clean picture. Corners whose sides cannot be fitted stay where they were; the result is how many could.
int fit_square_edges(const GreyImage& image, std::array<glm::dvec2, 4>& corner_px);

/// The mean of the channels in linear light, (code value / 255)^exponent. A lens and a pixel blur an edge evenly to
/// both sides in linear light; the curve of a picture lifts the dark side, so that the edge in code values lies up to
/// 0.3 pixels inside the square.
GreyImage linear_grey(const Rgb8Image& picture, double exponent);

} // namespace daylit::detail
