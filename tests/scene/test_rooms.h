#pragma once

// Small rooms for tests, built face by face.

#include <initializer_list>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include "scene/room/room.h"

namespace daylit::test {

class RoomBuilder {
public:
  std::uint32_t material(const std::string& name, Rgb reflectance = Rgb(0.5f), Rgb transmittance = Rgb(1.0f)) {
    room.materials.push_back({name, reflectance, transmittance, is_window_name(name)});
    return static_cast<std::uint32_t>(room.materials.size() - 1);
  }
  void quad(glm::dvec3 a, glm::dvec3 b, glm::dvec3 c, glm::dvec3 d, std::uint32_t material) {
    const auto first = static_cast<std::uint32_t>(room.vertices.size());
    room.vertices.insert(room.vertices.end(), {a, b, c, d});
    room.triangles.push_back({{first, first + 1, first + 2}, material});
    room.triangles.push_back({{first, first + 2, first + 3}, material});
  }
  /// Axis-aligned box; faces: bit 0 x-, 1 x+, 2 y-, 3 y+, 4 floor, 5 top.
  void box(glm::dvec3 l, glm::dvec3 h, std::uint32_t material, unsigned faces = 63) {
    if (faces & 1)
      quad({l.x, l.y, l.z}, {l.x, h.y, l.z}, {l.x, h.y, h.z}, {l.x, l.y, h.z}, material);
    if (faces & 2)
      quad({h.x, l.y, l.z}, {h.x, l.y, h.z}, {h.x, h.y, h.z}, {h.x, h.y, l.z}, material);
    if (faces & 4)
      quad({l.x, l.y, l.z}, {l.x, l.y, h.z}, {h.x, l.y, h.z}, {h.x, l.y, l.z}, material);
    if (faces & 8)
      quad({l.x, h.y, l.z}, {h.x, h.y, l.z}, {h.x, h.y, h.z}, {l.x, h.y, h.z}, material);
    if (faces & 16)
      quad({l.x, l.y, l.z}, {h.x, l.y, l.z}, {h.x, h.y, l.z}, {l.x, h.y, l.z}, material);
    if (faces & 32)
      quad({l.x, l.y, h.z}, {l.x, h.y, h.z}, {h.x, h.y, h.z}, {h.x, l.y, h.z}, material);
  }
  /// Wall in the plane y = `y` with a rectangular hole, as four quads that meet at T-junctions.
  void wall_with_hole(double y, double x0, double x1, double z0, double z1, double hx0, double hx1, double hz0,
                      double hz1, std::uint32_t material) {
    const auto part = [&](double a, double b, double c, double d) {
      quad({a, y, c}, {b, y, c}, {b, y, d}, {a, y, d}, material);
    };
    part(x0, hx0, z0, z1);
    part(hx1, x1, z0, z1);
    part(hx0, hx1, z0, hz0);
    part(hx0, hx1, hz1, z1);
  }
  Room room;
};

/// 4 x 5 x 3 m, hole x 1..3, z 1..2 in the wall y = 0.
inline RoomBuilder room_with_hole(glm::dvec3 at = glm::dvec3(0.0)) {
  RoomBuilder b;
  const std::uint32_t grey = b.material("grey");
  b.box({0, 0, 0}, {4, 5, 3}, grey, 63 & ~4u);
  b.wall_with_hole(0, 0, 4, 0, 3, 1, 3, 1, 2, grey);
  for (glm::dvec3& v : b.room.vertices)
    v += at;
  return b;
}

} // namespace daylit::test
