#pragma once

// Rooms that break renderers, built in memory: thin gaps, slivers, doubled and crossing faces, thousands of facets,
// white walls, scales and places far from one metre and the origin.

#include <string>
#include <vector>

#include "scene/room/room.h"

namespace daylit::bench {

struct StressRoom {
  std::string name;
  Room room;
};

/// Reflectance 0.6, a hole in the south wall, one box flush with the axes and one turned.
Room furnished_room(float reflectance = 0.6f);
/// Slivers on a wall and in the air, faces that lie on a wall a second time, a shelf through the north wall.
void add_bad_faces(Room& room);
/// A closed skin one millimetre outside the walls, open to the south: light enters the gap through its rim.
void add_outer_skin(Room& room);
/// Every second face turned over.
void reverse_half(Room& room);
Room moved(Room room, double scale, const glm::dvec3& shift);

/// All of them with daylight, each baking in seconds.
std::vector<StressRoom> stress_rooms();

} // namespace daylit::bench
