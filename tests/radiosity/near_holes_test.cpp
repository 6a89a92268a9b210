// Facets in the ducts of small holes.

#include <algorithm>
#include <limits>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "radiosity/detail/near_holes.h"
#include "radiosity/surface_mesh.h"
#include "tests/radiosity/rooms.h"

namespace daylit::radiosity {
namespace {

using testing::add_quad;

constexpr double kWidth_m = 0.1, kThick_m = 0.3, kWall_m = 4.0;

/// Of the hole in the plane x = 0, its middle at the origin.
HoleOutline square() {
  const double h = 0.5 * kWidth_m;
  return {{0, -h, -h}, {0, h, -h}, {0, h, h}, {0, -h, h}};
}

/// The four sides of a duct from x = 0 on, and a wall of 4 x 4 m in the plane in which it begins.
Room duct() {
  Room room;
  room.materials.resize(2);
  const HoleOutline hole = square();
  for (std::size_t k = 0; k < 4; ++k) {
    const glm::dvec3 &a = hole[k], &b = hole[(k + 1) % 4], in{kThick_m, 0, 0};
    add_quad(room, a, b, b + in, a + in, 1);
    add_quad(room, a, b, kWall_m / kWidth_m * b, kWall_m / kWidth_m * a, 0);
  }
  return room;
}

double longest_edge(const SurfaceMesh& mesh, std::uint32_t material) {
  double longest = 0;
  for (const Facet& f : mesh.facets)
    for (std::size_t k = 0; k < 3 && f.material == material; ++k)
      longest = std::max(longest, glm::distance(f.corner[k], f.corner[(k + 1) % 3]));
  return longest;
}

TEST(NearHoles, facets_in_a_duct_are_as_long_as_half_its_width_and_those_of_the_wall_as_before) {
  const Room room = duct();
  std::vector<HoleOutline> holes{square()};
  for (glm::dvec3& c : holes[0])
    c -= room.bounds().centre();
  const auto with = mesh_surfaces(room, {.edge_m = 1.0, .holes = holes}),
             without = mesh_surfaces(room, {.edge_m = 1.0});
  ASSERT_TRUE(with && without);
  EXPECT_GT(longest_edge(*without, 1), 0.9 * kThick_m);
  EXPECT_LE(longest_edge(*with, 1), 1.01 * 0.5 * kWidth_m);
  EXPECT_GT(longest_edge(*with, 0), 0.5 * longest_edge(*without, 0));
}

TEST(NearHoles, edges_are_short_on_the_sides_of_the_duct_alone) {
  const std::vector<HoleOutline> holes{square()};
  const NearHoles near(holes, group_planes(duct(), glm::dvec3(0.0)));
  const double half = 0.5 * kWidth_m;
  EXPECT_DOUBLE_EQ(near.edge_m({0.2, 0.01, half}, {0, 0, 1}), half);
  EXPECT_DOUBLE_EQ(near.edge_m({-0.2, half, 0.03}, {0, -1, 0}), half);
  for (const auto& [p, normal] : {std::pair<glm::dvec3, glm::dvec3>{{0.2, 0.2, half}, {0, 0, 1}}, // beside it
                                  {{0.7, 0.01, half}, {0, 0, 1}},                                 // beyond its wall
                                  {{0.0, half, 0.01}, {1, 0, 0}}})                                // the wall
    EXPECT_EQ(near.edge_m(p, normal), std::numeric_limits<double>::infinity()) << p.x;
}

TEST(NearHoles, the_end_of_a_tube_is_none) {
  Room tube = duct();
  std::erase_if(tube.triangles, [](const RoomTriangle& t) { return t.material == 0; });
  const std::vector<HoleOutline> holes{square()};
  const NearHoles near(holes, group_planes(tube, glm::dvec3(0.0)));
  EXPECT_EQ(near.edge_m({0.2, 0.01, 0.5 * kWidth_m}, {0, 0, 1}), std::numeric_limits<double>::infinity());
}

TEST(NearHoles, a_slit_has_edges_of_a_quarter_of_its_length) {
  const std::vector<HoleOutline> holes{{{0, 0, 0}, {0, 0.3, 0}, {0, 0.3, 0.01}, {0, 0, 0.01}}};
  EXPECT_NEAR(NearHoles(holes, group_planes(duct(), glm::dvec3(0.0))).edge_m({0.1, 0.1, 0}, {0, 0, 1}), 0.075, 1e-4);
}

} // namespace
} // namespace daylit::radiosity
