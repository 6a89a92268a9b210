#pragma once

// Joints of a model that do not close: an edge that runs beside another surface and does not touch it, so that light
// comes in between. Modellers overlook them; a wall that ends 3 mm above the floor is one.

#include <array>
#include <vector>

#include <glm/vec3.hpp>

#include "scene/core/result.h"
#include "scene/room/room.h"

namespace daylit {

constexpr double kWidestGap_m = 0.02; ///< what is wider is an opening

struct Gap {
  /// From the edge to the other surface and back: two points on the edge, then those across. Metres.
  std::array<glm::dvec3, 4> corners{};
  double widest_m = 0, length_m = 0, area_m2 = 0;
  std::uint32_t material = 0; ///< of the edge's surface
};

struct Gaps {
  std::vector<Gap> list; ///< through which lines join the outside and a surface, the largest first
  double widest_m = 0, length_m = 0, area_m2 = 0;
  bool complete = true; ///< false: so many edges that only those with surface on one side were followed, or none
};

/// Gaps up to `widest_m` that lines pass which cross no aperture. Surfaces count as joined within 1e-6 of the room.
/// Error: no ray scene can be made of the room.
Result<Gaps> find_gaps(const Room& room, const std::vector<Aperture>& apertures, double widest_m = kWidestGap_m);

/// Fills each gap with a strip of the material of its edge.
void close_gaps(Room& room, const Gaps& gaps);

} // namespace daylit
