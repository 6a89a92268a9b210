#pragma once

// Where the sun strikes the room: its patches of light as points of known power.

#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "runtime/indirect/room_planes.h"
#include "runtime/object/placed_parts.h"
#include "runtime/sky/direct_light.h"
#include "scene/room/ray_scene.h"

namespace daylit {

struct SunlitPoint {
  glm::dvec3 position{0.0}; ///< in the air before the surface, world metres
  glm::dvec3 normal{0.0};   ///< of the lit side
  Rgb power{0.0f};          ///< that it sends back, in the unit of irradiance x m^2
  double spacing_m = 0.0;   ///< of such points: the root of the lit area for which it stands
};

/// One for each cell of a window through which the sun shines; of very many a regular choice, heavier. Near objects
/// cells are cut in four until the points are closer to each other than to the objects: what is behind an object may be
/// as near to a wall as the object is.
std::vector<SunlitPoint> sunlit_points(const Room& room, const RayScene& rays, const RoomPlanes& planes,
                                       std::span<const Aperture> apertures, std::span<const ApertureCell> cells,
                                       const DetectedSun& sun, const PlacedParts& parts);

} // namespace daylit
