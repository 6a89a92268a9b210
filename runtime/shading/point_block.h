#pragma once

#include <glm/vec3.hpp>

#include "runtime/base/lanes.h"

namespace daylit {

/// Up to sixteen points with normals, metres relative to the scene's origin; unused lanes hold copies of the first.
struct alignas(64) PointBlock {
  float x[kLanes], y[kLanes], z[kLanes];
  float nx[kLanes], ny[kLanes], nz[kLanes]; ///< unit, towards the side that is lit; zero in unused lanes
  LaneMask lanes = 0;                       ///< that are used
  glm::vec3 centre{0.0f};                   ///< of a sphere around the points
  float radius = 0.0f;

  void set(int lane, const glm::vec3& position, const glm::vec3& normal);
  /// The first `count` lanes are used. The others repeat the first point, so that vector code needs no masks.
  void close(int count);
};

/// One value per lane and colour channel.
struct alignas(64) LaneRgb {
  float channel[3][kLanes] = {};
};

/// Directions of sixteen lights; the last block repeats its last light.
struct alignas(64) DirectionBlock {
  float x[kLanes], y[kLanes], z[kLanes];
};

} // namespace daylit
