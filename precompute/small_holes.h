#pragma once

// Holes between rooms that are small beside the distance of probes. On the darker side most light close by comes
// through the hole and falls off with the square of the distance to it.

#include <vector>

#include <glm/vec3.hpp>

#include "precompute/standing_faces.h"
#include "radiosity/detail/aimed_rays.h"
#include "scene/room/aperture.h"
#include "scene/room/ray_scene.h"
#include "scene/room/room.h"

namespace daylit::precompute {

struct SmallHole {
  std::vector<glm::dvec3> corners; ///< of its outline, in order, world metres
  Bounds box;                      ///< that holds them
  glm::dvec3 normal{0.0};          ///< unit, of either sign
};

/// Outlines up to 0.3 m across with air on both sides and no pane. One in a thick wall has two.
std::vector<SmallHole> small_holes(const Room& room, const RayScene& rays, const std::vector<Aperture>& apertures);

/// Their convex parts, relative to `origin`.
std::vector<radiosity::HoleOutline> convex_outlines(const std::vector<SmallHole>& holes, const glm::dvec3& origin);

/// Adds planes of probes around each hole, wanted within half a metre of it; none leads through the hole itself, which
/// would join the air of both sides. Nothing for holes in oblique walls.
void add_planes_near(const std::vector<SmallHole>& holes, Planes& planes);

} // namespace daylit::precompute
