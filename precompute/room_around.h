#pragma once

#include <vector>

#include <glm/vec3.hpp>

#include "scene/core/result.h"
#include "scene/room/aperture.h"
#include "scene/room/ray_scene.h"
#include "scene/room/room.h"

namespace daylit::precompute {

double volume(const Bounds& box); ///< of its three sides, m^3

/// The box of the room around a point (world metres), from rays to the surfaces seen there: what lies behind a door or
/// another small gap is left out. A room that is no box is covered as far as the point sees it.
/// Error value_invalid: nothing encloses the point.
Result<Bounds> room_around(const Room& room, const glm::dvec3& point);

/// The box of the air in which points stand (world metres): of the surfaces seen from them without looking through an
/// opening. All of the room's bounds where nothing encloses one of them.
Bounds air_around(const Room& room, const RayScene& scene, const std::vector<Aperture>& apertures,
                  const std::vector<glm::dvec3>& points);

} // namespace daylit::precompute
