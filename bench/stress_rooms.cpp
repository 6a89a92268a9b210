#include "bench/stress_rooms.h"

#include <array>
#include <cmath>
#include <utility>

#include <glm/vec2.hpp>

#include "bench/room_parts.h"

namespace daylit::bench {

namespace {

constexpr int kSphereCuts = 32; // 20 * 32^2 = 20,480 facets

template <class Change>
Room furnished_and(const Change& change) {
  Room room = furnished_room();
  change(room);
  return room;
}

} // namespace

Room furnished_room(float reflectance) {
  Room room = room_with_window_hole(reflectance);
  add_box(room, {0.5, 3.1, 0}, {1.3, 4.2, 1.1}, 0b111110u, false);
  const double c = std::cos(0.3), s = std::sin(0.3);
  const auto at = [&](double u, double v, double z) { return glm::dvec3(2.7 + c * u - s * v, 1.9 + s * u + c * v, z); };
  const std::array<glm::dvec2, 4> base = {glm::dvec2(-0.4, -0.3), {0.4, -0.3}, {0.4, 0.3}, {-0.4, 0.3}};
  for (std::size_t k = 0; k < 4; ++k) {
    const glm::dvec2 p = base[k], q = base[(k + 1) % 4];
    add_quad(room, at(p.x, p.y, 0), at(q.x, q.y, 0), at(q.x, q.y, 0.7), at(p.x, p.y, 0.7));
  }
  add_quad(room, at(-0.4, -0.3, 0.7), at(0.4, -0.3, 0.7), at(0.4, 0.3, 0.7), at(-0.4, 0.3, 0.7));
  return room;
}

void add_bad_faces(Room& room) {
  add_quad(room, {0, 2, 1}, {0, 4, 1}, {0, 4, 1.000002}, {0, 2, 1.000002});         // sliver on the west wall
  add_quad(room, {1, 1, 1}, {3, 1, 1}, {3, 1.000002, 1}, {1, 1.000002, 1});         // sliver in the air
  add_quad(room, {4, 1, 1}, {4, 3, 1}, {4, 3, 2}, {4, 1, 2});                       // on the east wall, again
  add_quad(room, {4 + 1e-9, 1, 1}, {4, 3, 1}, {4 + 1e-9, 3, 2}, {4, 1, 2});         // and nearly
  add_quad(room, {1, 4.5, 0.5}, {1.5, 4.5, 0.5}, {1.5, 5.2, 0.55}, {1, 5.2, 0.55}); // a shelf through the north wall
  add_quad(room, {1.2, 4.6, 0.3}, {1.3, 4.6, 0.3}, {1.3, 4.9, 0.8}, {1.2, 4.9, 0.8});
}

void add_outer_skin(Room& room) { add_box(room, {-0.001, -0.001, -0.001}, {4.001, 5.001, 2.801}, 0b111011u, false); }

void reverse_half(Room& room) {
  for (std::size_t i = 0; i < room.triangles.size(); i += 2)
    std::swap(room.triangles[i].vertex[0], room.triangles[i].vertex[2]);
}

Room moved(Room room, double scale, const glm::dvec3& shift) {
  for (glm::dvec3& v : room.vertices)
    v = scale * v + shift;
  return room;
}

std::vector<StressRoom> stress_rooms() {
  return {{"empty, a hole to the south", room_with_window_hole(0.6f)},
          {"furnished", furnished_room()},
          {"reflectance 0.99", furnished_room(0.99f)},
          {"reflectance 0.999", furnished_room(0.999f)},
          {"half of the faces reversed", furnished_and(reverse_half)},
          {"slivers of 1e6, doubled and crossing faces", furnished_and(add_bad_faces)},
          {"a board 1 mm thick", furnished_and([](Room& r) {
             add_box(r, {1.9, 3.0, 0}, {1.901, 4.5, 1.8}, 0b111110u, false);
           })},
          {"two boards 1 mm apart", furnished_and([](Room& r) {
             for (const double x : {1.9, 1.901})
               add_quad(r, {x, 3.0, 0.3}, {x, 4.5, 0.3}, {x, 4.5, 1.8}, {x, 3.0, 1.8});
           })},
          {"a second skin 1 mm outside the walls", furnished_and(add_outer_skin)},
          {"a sphere of 20,480 facets", furnished_and([](Room& r) {
             add_sphere(r, {1.4, 1.2, 1.7}, 0.6, kSphereCuts);
           })},
          {"4 mm long", moved(furnished_room(), 1e-3, glm::dvec3(0.0))},
          {"40 km long", moved(furnished_room(), 1e4, glm::dvec3(0.0))},
          {"1,000 km from the origin", moved(furnished_room(), 1.0, {1e6, 0, 0})}};
}

} // namespace daylit::bench
