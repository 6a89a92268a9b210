// Facets beside faces that come close to them: furniture a little off a wall.

#include <algorithm>

#include <gtest/gtest.h>

#include "radiosity/surface_mesh.h"
#include "tests/radiosity/rooms.h"

namespace daylit::radiosity {
namespace {

using testing::add_quad;

/// Facets of the floor that lie on both sides of the outline of a board [0.7, 2.4] x [1, 2.2].
std::size_t half_below_board(double height, double near_m) {
  Room room;
  room.materials.push_back({});
  add_quad(room, {0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0});
  add_quad(room, {0.7, 1, height}, {2.4, 1, height}, {2.4, 2.2, height}, {0.7, 2.2, height});
  const auto mesh = mesh_surfaces(room, {.edge_m = 0.4, .near_m = near_m});
  EXPECT_TRUE(mesh);
  std::size_t halves = 0;
  for (const Facet& p : mesh->facets) {
    bool inside = false, outside = false;
    for (const glm::dvec3& c : p.corner) {
      const glm::dvec3 w = c + mesh->origin;
      if (w.z > 0.5 * height)
        continue;
      inside |= w.x > 0.7 + 1e-6 && w.x < 2.4 - 1e-6 && w.y > 1 + 1e-6 && w.y < 2.2 - 1e-6;
      outside |= w.x < 0.7 - 1e-6 || w.x > 2.4 + 1e-6 || w.y < 1 - 1e-6 || w.y > 2.2 + 1e-6;
    }
    halves += inside && outside ? 1 : 0;
  }
  return halves;
}

TEST(NearEdges, no_facet_is_half_behind_a_face_that_ends_close_to_it) {
  EXPECT_EQ(half_below_board(0.005, 0.08), 0u);
  EXPECT_EQ(half_below_board(0.05, 0.08), 0u);
  EXPECT_GT(half_below_board(0.005, 0.0), 4u);
  EXPECT_GT(half_below_board(0.3, 0.08), 4u); // light comes in below
}

TEST(NearEdges, small_things_close_to_a_wall_do_not_cut_it) {
  Room room;
  room.materials.push_back({});
  add_quad(room, {0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0});
  const auto alone = mesh_surfaces(room, {.edge_m = 0.4, .near_m = 0.08});
  for (int i = 0; i < 9; ++i)
    add_quad(room, {0.3 + 0.4 * i, 1, 0.01}, {0.5 + 0.4 * i, 1, 0.01}, {0.5 + 0.4 * i, 1.3, 0.01},
             {0.3 + 0.4 * i, 1.3, 0.01});
  const auto with_books = mesh_surfaces(room, {.edge_m = 0.4, .near_m = 0.08});
  ASSERT_TRUE(alone && with_books);
  const auto on_floor = std::ranges::count_if(with_books->facets, [](const Facet& p) { return p.plane == 0; });
  EXPECT_EQ(static_cast<std::size_t>(on_floor), alone->facets.size());
}

} // namespace
} // namespace daylit::radiosity
