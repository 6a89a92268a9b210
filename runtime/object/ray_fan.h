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
  for (std::size_t k = 0; k < 16; ++k)
    packet.set(k, from, direction(std::min(k, count - 1)), 0.0f, tfar);
  return packet;
}

} // namespace daylit
