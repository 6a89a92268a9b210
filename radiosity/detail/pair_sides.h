#pragma once

// On which side of planes the segments between one triangle and many lie, sixteen triangles at a time.

#include <cstdint>

namespace daylit::radiosity {

/// Heights over one plane, metres: of the corners of one triangle, and of those of every column.
struct CornerHeights {
  float one[3];
  const float *c0, *c1, *c2; ///< [column]
};

/// side[j]: +1 when the one lies above the plane and column j below it, -1 the other way round, 2 when both lie on
/// the same side, 0 when the plane cuts one of the two. Heights up to `tolerance` count as on the plane.
void plane_sides(const CornerHeights& plane, std::uint32_t count, float tolerance, std::int32_t* side);

/// For one edge of a polygon in that plane (heights over the plane through the edge, positive inside): outside[j]
/// becomes 1 when every segment passes on the outer side of the edge, inside[j] 0 unless every segment passes on its
/// inner side. A segment with ends a and b at heights ha and hb crosses the plane at (ha b - hb a) / (ha - hb).
void edge_sides(const CornerHeights& plane, const CornerHeights& edge, std::uint32_t count, float tolerance,
                const std::int32_t* side, std::int32_t* outside, std::int32_t* inside);

} // namespace daylit::radiosity
