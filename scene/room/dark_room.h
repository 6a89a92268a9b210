#pragma once

#include <vector>

#include <glm/vec3.hpp>

#include "scene/room/ray_scene.h"
#include "scene/room/room.h"

namespace daylit {

/// Is the point in a closed space that no light can enter and a person could stand in (1.2 x 1.2 x 1.5 m)? A smaller
/// one is the inside of furniture. Found by 2,048 rays of diffuse walks, of which none may leave or cross an aperture.
bool is_in_dark_room(const RayScene& scene, const Room& room, const std::vector<Aperture>& apertures,
                     const glm::dvec3& point);

} // namespace daylit
