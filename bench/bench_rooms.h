#pragma once

#include <string>
#include <vector>

#include "scene/core/result.h"
#include "scene/room/room_formats.h"

namespace daylit::bench {

struct BenchRoom {
  std::string name;
  RoomFile file;
  std::vector<glm::dvec3> points; ///< in the air, at least 0.25 m from surfaces
};

/// Generated rooms: "cornell" (the demo's, one hole), "office" (two panes, a desk and a cupboard), "l_shape" (one pane,
/// half of the room without a view of it), "storeys" (three rooms, joined by a door and a stairwell).
Result<std::vector<BenchRoom>> bench_rooms();

} // namespace daylit::bench
