#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>

#include <glm/vec3.hpp>

#include "scene/room/ray_scene.h"

namespace daylit {

/// Up to sixteen rays from one point: direction(k) of the first `count`; the other lanes repeat the last.
template <class Direction>
RayPacket16 ray_fan(const glm::vec3& from, std::size_t count, Direction direction,
                    float tfar = std::numeric_limits<float>::infinity()) {
  RayPacket16 packet;
  for (std::size_t k = 0; k < 16; ++k) {
    const glm::vec3 w = direction(std::min(k, count - 1));
    packet.org_x[k] = from.x;
    packet.org_y[k] = from.y;
    packet.org_z[k] = from.z;
    packet.dir_x[k] = w.x;
    packet.dir_y[k] = w.y;
    packet.dir_z[k] = w.z;
    packet.tnear[k] = 0.0f;
    packet.tfar[k] = tfar;
  }
  return packet;
}

} // namespace daylit
