#pragma once

// Triangulation of one plane (constrained Delaunay refinement after Ruppert 1995 and Shewchuk 2000).

#include <array>
#include <functional>
#include <vector>

#include <glm/vec2.hpp>

#include "radiosity/detail/plane_groups.h"
#include "radiosity/detail/snap_segments.h"

namespace daylit::radiosity {

using Triangle2 = std::array<glm::dvec2, 3>;

/// Border of the union of the group's triangles, overlaps and T-junctions resolved, with the contact lines that lie in
/// it; no two segments cross.
std::vector<Segment2> find_outline(const PlaneGroup& group, double tolerance_m);

/// Longest edge at a point of the plane, metres.
using EdgeLength2 = std::function<double(const glm::dvec2&)>;

/// Triangles, counter-clockwise, that cover the group: edges up to `edge_m`, angles above 20 degrees except where the
/// outline itself is narrower than a tenth of it. There triangles are long instead of many, so that a face one
/// millimetre wide costs a handful. Stops, unfinished, beyond `limit` triangles.
std::vector<Triangle2> mesh_plane(const PlaneGroup& group, const std::vector<Segment2>& outline,
                                  const EdgeLength2& edge_m, std::size_t limit);

} // namespace daylit::radiosity
