#pragma once

// Light from one surface of the room to another: where an object stands in a corner or beside a wall, the wall that it
// shades sends less to the floor beside it.

#include <functional>
#include <vector>

#include "runtime/indirect/receiver_lattice.h"

namespace daylit {

/// A surface of the room that a point of it sees past the objects, where these may have changed its light.
struct ChangedSurface {
  Rgb weight{0.0f}; ///< rho / pi cos dw of the directions: of its irradiance in that of the point
  ReceiverLattice::Link link;
};

/// Nodes that stand for a point of a triangle seen along a direction from so many radii of the smallest object away.
using LinkTo = std::function<ReceiverLattice::Link(std::uint32_t triangle, const glm::dvec3& x,
                                                   const glm::dvec3& direction, double radii_away)>;

/// As x with normal n, in the air before the room's surface, sees them in the directions of the pattern. None where
/// x is far from all objects.
std::vector<ChangedSurface> find_changed_surfaces(const LitScene& scene, const glm::dvec3& x, const glm::dvec3& n,
                                                  const DirectionPattern& pattern, const LinkTo& link);
/// What x sees of the room that lamps light; `far`: all that find_changed_surfaces() does not find. Empty without
/// lamps.
LampView look_at_lamps(const LitScene& scene, const glm::dvec3& x, const glm::dvec3& n,
                       const DirectionPattern& pattern);

} // namespace daylit
