#pragma once

// Pairs of triangles, sixteen at a time: rays between points of them, and on which side of planes the segments between
// one triangle and many lie.

#include <cstdint>

#include "scene/room/ray_scene.h"

namespace daylit::radiosity {

/// What 16 lanes sample: a pair of triangles and a position in its low-discrepancy sequence each.
struct alignas(64) PairLanes {
  float from[9][16], to[9][16]; ///< corner and two edges of both triangles, in the coordinates of the ray scene
  float normal_from[3][16], normal_to[3][16];
  float shift[4][16];      ///< of the sequence
  float scale[16];         ///< of the kernel: areas of parts
  std::uint32_t index[16]; ///< in the sequence
};

/// One ray per lane, from a point uniform on the first triangle to one uniform on the second, `gap` (scene units)
/// short of both; weight[lane]: its kernel cos cos / r^2 times the lengths of the normals.
void pair_rays(const PairLanes& lanes, float gap, RayPacket16& packet, float* weight);

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
