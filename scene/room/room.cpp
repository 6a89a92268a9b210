#include "scene/room/room.h"

#include <glm/geometric.hpp>

#include "scene/core/lower_case.h"

namespace daylit {

bool is_window_name(const std::string& material_name) {
  const std::string name = lower_case(material_name);
  return name == "window" || name.starts_with("window_") || name.starts_with("window.");
}

Bounds Room::bounds() const {
  Bounds b;
  for (const RoomTriangle& t : triangles)
    for (int k = 0; k < 3; ++k)
      b.include(corner(t, k));
  return b;
}

glm::dvec3 area_normal(const Room& room, const RoomTriangle& t) {
  const glm::dvec3 a = room.corner(t, 0);
  return glm::cross(room.corner(t, 1) - a, room.corner(t, 2) - a);
}

double area_m2(const Room& room, const RoomTriangle& t) { return 0.5 * glm::length(area_normal(room, t)); }

} // namespace daylit
