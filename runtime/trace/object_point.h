#pragma once

#include "runtime/trace/traced_scene.h"
#include "runtime/trace/visible_surfaces.h"

namespace daylit {

struct ObjectPoint {
  glm::vec3 position{0.0f}, normal{0.0f}; ///< normal: shading, on the side that is seen
  bool back = false;                      ///< the inside of a thin shell
};
/// How far above the surface shadow rays start, metres.
float start_offset(const TracedScene& scene);
ObjectPoint object_point(const TracedScene& scene, const glm::vec3& eye, const ObjectHit& hit);
/// Where the shadow rays of that point start.
glm::vec3 ray_start(const TracedScene& scene, const ObjectHit& hit, const ObjectPoint& point);

} // namespace daylit
