#pragma once

#include <array>
#include <vector>

#include <glm/vec2.hpp>

namespace daylit::radiosity {

using Segment2 = std::array<glm::dvec2, 2>;

/// Merges end points closer than `tolerance_m`, splits every segment at the end points that lie on it within
/// `tolerance_m`, drops empty and repeated segments. Afterwards no end point is nearly, but not exactly, on another
/// segment: that near miss is what makes a triangulator refine down to rounding size.
std::vector<Segment2> snap_segments(const std::vector<Segment2>& segments, double tolerance_m);

} // namespace daylit::radiosity
