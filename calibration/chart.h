#pragma once

// The 24 patches of a chart in a picture.

#include <array>
#include <optional>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "calibration/colour_science.h"
#include "scene/image/image_formats.h"
#include "scene/image/rgb_image.h"

namespace daylit::calibration {

/// Middles of four corner patches: dark skin, bluish green, black, white (first row's ends, then the last row's).
using ChartCorners = std::array<glm::dvec2, 4>;

/// In a picture of 8 bits, whichever way the chart is turned; nothing where there is none.
std::optional<ChartCorners> find_chart(const Rgb8Image& picture);

/// Angle by which the chart is turned, degrees, 0 where its first row is on top; -180..180.
double turn_of(const ChartCorners& corners);

struct ChartPatch {
  glm::dvec2 at{0.0};   ///< in the chart: -0.5..0.5 along its longer side, and across it in the same unit
  glm::dvec2 px{0.0};   ///< middle, in the picture
  glm::dvec3 code{0.0}; ///< median of each channel over its middle
  bool saturated = false;
};

/// Empty where a patch lies outside the picture.
std::optional<std::array<ChartPatch, kPatches>> sample_chart(const RgbImage& code, const ChartCorners& corners);

} // namespace daylit::calibration
