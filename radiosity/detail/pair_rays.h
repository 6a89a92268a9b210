#pragma once

// Sixteen rays between points of pairs of triangles.

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

} // namespace daylit::radiosity
