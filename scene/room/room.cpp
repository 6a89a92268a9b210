#include "scene/room/room.h"

#include <glm/geometric.hpp>

namespace daylit {

bool is_window_name(const std::string& material_name) {
  return material_name == "window" || material_name.starts_with("window_") || material_name.starts_with("window.");
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
