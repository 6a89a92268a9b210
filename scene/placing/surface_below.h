#pragma once

// Which surface of a room is below a place, and whether something can stand there: a surface counts where the room's
// air is above it, high enough. Faces have no outside, so that the air is what light can leave: walks that are
// scattered at the surfaces come out through a window or a hole.

#include <cstdint>
#include <string>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "scene/core/result.h"
#include "scene/room/ray_scene.h"
#include "scene/room/room.h"

namespace daylit {

struct SurfaceBelow {
  double height_m = 0.0;      ///< world z
  std::uint32_t triangle = 0; ///< of the room
};

/// The surface below world (x, y) with `free_m` of air above it.
/// `name`: a material of the room, its case of no matter: the highest surface of it. "floor", where no material is
/// called so: the lowest surface. Empty: the highest surface under the ceiling. Error not_found: there is none; names
/// what is there.
Result<SurfaceBelow> surface_below(const Room& room, const RayScene& rays, const glm::dvec2& place,
                                   const std::string& name, double free_m);

/// Middle of the highest level surface of that material with `free_m` of the room's air and a ceiling above it, world
/// (x, y); of the highest one where none is so. Error not_found: no face of it is level.
Result<glm::dvec2> middle_of(const Room& room, const RayScene& rays, const std::string& name, double free_m);

/// Does light come from a window or hole to this point, given in the scene's own coordinates?
bool is_in_air(const Room& room, const RayScene& rays, const glm::vec3& local_point);

} // namespace daylit
