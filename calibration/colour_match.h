#pragma once

// Two cameras before the same chart: from the colours of one to those of the other.

#include <array>
#include <optional>

#include <glm/mat3x3.hpp>

#include "calibration/chart.h"

namespace daylit::calibration {

struct ColourMatch {
  glm::dmat3 matrix{1.0}; ///< second camera = matrix x first camera, linear codes of both
  double before = 0.0;    ///< mean Delta E 2000 between the two, the first scaled to the luminance of the second
  double held_out = 0.0;  ///< the same after the matrix, each patch with one that does not know it
};

/// Least squares over the patches that are saturated in neither; codes of both cameras are linear. `rec709_from_second`
/// serves to judge the differences as people see them. Nothing where fewer than 18 patches are left.
std::optional<ColourMatch> match_colours(const std::array<ChartPatch, kPatches>& first,
                                         const std::array<ChartPatch, kPatches>& second,
                                         const glm::dmat3& rec709_from_second);

} // namespace daylit::calibration
