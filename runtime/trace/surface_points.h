#pragma once

#include "runtime/trace/traced_scene.h"
#include "runtime/trace/visible_surfaces.h"

namespace daylit {

/// How far above an object's surface shadow rays start, metres.
float start_offset(const TracedScene& scene);
/// The point of an object that a pixel shows, with its shading normal on the side that is seen.
PixelSurface object_surface(const TracedScene& scene, const glm::vec3& eye, const ObjectHit& hit);
/// `triangle`: of the room's ray scene.
PixelSurface room_surface(const TracedScene& scene, const glm::vec3& eye, std::uint32_t triangle,
                          const glm::vec3& position, bool receives);

} // namespace daylit
