// Facets are larger where what they send hardly reaches the receivers.

#include "radiosity/size_field.h"

#include <gtest/gtest.h>

#include "radiosity/surface_mesh.h"
#include "tests/scene/test_rooms.h"

namespace daylit::radiosity {
namespace {

/// Two rooms of 4 x 4 x 3 m side by side along y, joined by a hole of 0.4 x 0.4 m.
Room two_rooms() {
  test::RoomBuilder b;
  const auto wall = b.material("wall");
  b.box({0, 0, 0}, {4, 4, 3}, wall, 63 & ~8u);
  b.box({0, 4, 0}, {4, 8, 3}, wall, 63 & ~4u);
  b.wall_with_hole(4.0, 0, 4, 0, 3, 1.8, 2.2, 1.3, 1.7, wall);
  return b.room;
}

TEST(SizeField, without_receivers_is_one_everywhere) {
  const Room room = two_rooms();
  const SizeField field(room, *RayScene::build(room), {});
  EXPECT_EQ(field.at({1, 1, 0}), 1.0);
  EXPECT_GE(field.importance({1, 7, 0}), 1.0);
}

TEST(SizeField, the_receivers_room_keeps_its_facets_and_the_next_one_has_larger_ones) {
  const Room room = two_rooms();
  const std::vector<glm::dvec3> receivers{{1, 1, 1}, {3, 2, 2}, {2, 3, 1}};
  const SizeField field(room, *RayScene::build(room), receivers);
  double own = 0, next = 0;
  for (double x = 0.25; x < 4; x += 0.5)
    for (double y = 0.25; y < 4; y += 0.5) {
      own = std::max(own, field.at({x, y, 0}));
      next += field.at({x, y + 4, 0}) / 64;
    }
  EXPECT_EQ(own, 1.0);
  EXPECT_GT(next, 1.5) << "a hundredth of the light comes through the hole";
  EXPECT_LE(next, SizeField::kCoarsest);
}

TEST(SizeField, a_mesh_has_its_facets_where_the_light_is_wanted) {
  const Room room = two_rooms();
  const std::vector<glm::dvec3> receivers{{1, 1, 1}, {3, 2, 2}, {2, 3, 1}};
  const SizeField field(room, *RayScene::build(room), receivers);
  const SurfaceMesh mesh = *mesh_surfaces(room, {.target_facets = 600, .field = field});
  int own = 0, next = 0;
  for (const Facet& f : mesh.facets)
    ++((f.corner[0] + f.corner[1] + f.corner[2]).y / 3.0 + mesh.origin.y < 4.0 ? own : next);
  EXPECT_NEAR(own + next, 600, 60);
  EXPECT_GT(own, 2 * next);
}

TEST(SizeField, facets_that_faces_make_by_themselves_are_those_of_the_longest_edges) {
  Room room = two_rooms();
  const auto at = [&](double x, double y, double z) {
    room.vertices.push_back({x, y, z});
    return static_cast<std::uint32_t>(room.vertices.size() - 1);
  };
  std::vector<Aperture> panes; // reveals of six windows of the room where no light is wanted
  for (int i = 0; i < 6; ++i) {
    const double x = 0.2 + 0.6 * i;
    panes.push_back({.corners = {{x, 8, 1}, {x + 0.4, 8, 1}, {x + 0.4, 8, 2}, {x, 8, 2}}, .inward = {0, -1, 0}});
    for (const double z : {1.0, 2.0}) {
      const std::array<std::uint32_t, 4> v{at(x, 8, z), at(x + 0.4, 8, z), at(x + 0.4, 7.9, z), at(x, 7.9, z)};
      room.triangles.push_back({{v[0], v[1], v[2]}, 0});
      room.triangles.push_back({{v[0], v[2], v[3]}, 0});
    }
  }
  const std::vector<glm::dvec3> receivers{{1, 1, 1}, {3, 2, 2}, {2, 3, 1}};
  const SizeField field(room, *RayScene::build(room), receivers);
  const SurfaceMesh mesh = *mesh_surfaces(room, {.target_facets = 600, .field = field, .panes = panes});
  const SurfaceMesh longest = *mesh_surfaces(room, {.edge_m = 1e6, .field = field, .panes = panes});
  EXPECT_GE(mesh.fixed_facets, 100u);
  EXPECT_EQ(mesh.fixed_facets, longest.facets.size());
}

} // namespace
} // namespace daylit::radiosity
