#pragma once

// [[object]] on: objects set down on surfaces of the room, standing on their lowest points.

#include <string>
#include <vector>

#include "scene/config/config.h"
#include "scene/core/result.h"
#include "scene/placing/standing.h"
#include "scene/room/ray_scene.h"
#include "scene/room/room.h"

namespace daylit {

/// The object with the position that `on` gives it; as it is where `on` is empty. The surface is the one below its
/// centre of mass; an open mesh that lies on a face of its own lies half a millimetre above it. Errors of
/// surface_below() and middle_of(), with the object's name.
Result<ObjectConfig> set_down(const ObjectConfig& object, const WeighedMesh& mesh, const Room& room,
                              const RayScene& rays);

/// Whether an object is cut by the room and, with `on`, whether it tips, or stands on a roof: a line each.
std::vector<std::string> standing_warnings(const ObjectConfig& object, const WeighedMesh& mesh, const Room& room,
                                           const RayScene& rays);

} // namespace daylit
