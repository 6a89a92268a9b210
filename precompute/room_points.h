#pragma once

// Points by which the error is told room by room: in each as many close to surfaces as in mid-air.

#include <vector>

#include <glm/vec3.hpp>

#include "scene/core/result.h"
#include "scene/room/room.h"

namespace daylit::precompute {

struct RoomPoints {
  Bounds box; ///< world metres, room_around() one of `in_air`
  std::vector<glm::dvec3> points = {};
  std::vector<double> weight = {}; ///< of each point: how much air it stands for, in any unit
};

/// The rooms in which `in_air` (world metres) stand, those with most of them first, at most 64. In each up to 120
/// points within `bounds` that one of `in_air` sees: forty each at 10 to 20, 20 to 50 cm and further off surfaces
/// (closer, the mesh that the light is compared on shows its facets: docs/notes/bake.md). The weights make them stand
/// for points spread evenly over the air of a room. A box may reach half a metre behind an open door, and a room that
/// is no box may count as several; boxes that nearly agree are joined, and pieces of a passage. Errors of the ray
/// scene.
Result<std::vector<RoomPoints>> points_by_room(const Room& room, const Bounds& bounds,
                                               const std::vector<glm::dvec3>& in_air);

} // namespace daylit::precompute
