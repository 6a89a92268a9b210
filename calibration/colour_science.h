#pragma once

// Colours of a chart with 24 patches, and differences of colours as people see them.

#include <array>
#include <cstddef>
#include <filesystem>
#include <span>

#include <glm/vec3.hpp>

#include "scene/core/result.h"

namespace daylit::calibration {

inline constexpr std::size_t kPatches = 24; ///< four rows of six: dark skin first, black last

/// Linear Rec. 709 of each patch under D65; 1 is a perfect white.
using ChartReference = std::array<glm::dvec3, kPatches>;

/// What the maker of the chart published.
ChartReference published_chart();
/// A file of sRGB values or of measured reflectances (see the error it gives).
Result<ChartReference> read_chart_reference(const std::filesystem::path& path);

/// Linear Rec. 709 under D65 of a reflectance at rising wavelengths, nm; constant beyond their ends.
glm::dvec3 rec709_of_reflectance(std::span<const double> nm, std::span<const double> reflectance);

/// CIE L*a*b* of linear Rec. 709, white (1, 1, 1).
glm::dvec3 lab_of(const glm::dvec3& rec709);
/// CIEDE2000 between two colours in L*a*b*.
double delta_e_2000(const glm::dvec3& a, const glm::dvec3& b);

} // namespace daylit::calibration
