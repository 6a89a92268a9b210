// Facets of sills and reveals beside a pane.

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "radiosity/surface_mesh.h"
#include "tests/radiosity/rooms.h"

namespace daylit::radiosity {
namespace {

using testing::add_quad;

/// A pane 2 m wide in the plane y = 0; of one material each a sill inside of it, one outside, and a wall below it in
/// its plane.
struct PaneAndSills {
  Room room;
  Aperture pane{{{0, 0, 1}, {0, 0, 2}, {2, 0, 2}, {2, 0, 1}}, {0, -1, 0}, Rgb(1.0f), 0.0f};
  /// `beyond`: so far does the inner sill go on outside.
  explicit PaneAndSills(double depth = 0.4, double beyond = 0.0) {
    room.materials.resize(3);
    add_quad(room, {0, -depth, 1}, {2, -depth, 1}, {2, beyond, 1}, {0, beyond, 1});
    add_quad(room, {0, 0, 1}, {2, 0, 1}, {2, 0.4, 1}, {0, 0.4, 1}, 1);
    add_quad(room, {0, 0, 0}, {2, 0, 0}, {2, 0, 0.9}, {0, 0, 0.9}, 2);
  }
};

/// Longest edge on the pane's lower side of the facets of the sill inside.
double longest_on_pane(const SurfaceMesh& mesh) {
  double longest = 0;
  for (const Facet& f : mesh.facets) {
    const auto y = [&](std::size_t k) { return f.corner[k % 3].y + mesh.origin.y; };
    for (std::size_t k = 0; k < 3; ++k)
      if (std::abs(y(k)) < 1e-9 && std::abs(y(k + 1)) < 1e-9 && y(k + 2) < -1e-9)
        longest = std::max(longest, glm::distance(f.corner[k], f.corner[(k + 1) % 3]));
  }
  return longest;
}

std::size_t facets_of(const SurfaceMesh& mesh, std::uint32_t material) {
  return static_cast<std::size_t>(std::ranges::count(mesh.facets, material, &Facet::material));
}

TEST(NearPanes, facets_of_a_sill_are_small_beside_its_pane_and_nowhere_else) {
  const PaneAndSills s;
  const auto without = mesh_surfaces(s.room, {.edge_m = 2.0});
  const auto with = mesh_surfaces(s.room, {.edge_m = 2.0, .panes = {&s.pane, 1}});
  ASSERT_TRUE(without && with);
  double area = 0;
  for (const Facet& f : with->facets)
    area += f.area_m2;
  EXPECT_NEAR(area, 2 * 0.4 + 2 * 0.4 + 2 * 0.9, 1e-9);
  EXPECT_LE(longest_on_pane(*with), 0.2501);
  EXPECT_GT(longest_on_pane(*without), 0.3);
  EXPECT_EQ(facets_of(*with, 1), facets_of(*without, 1)) << "outside";
  EXPECT_EQ(facets_of(*with, 2), facets_of(*without, 2)) << "in the plane of the pane";
}

TEST(NearPanes, facets_of_a_sill_shorten_towards_the_corners_of_its_pane) {
  const PaneAndSills s;
  const auto mesh = mesh_surfaces(s.room, {.edge_m = 2.0, .panes = {&s.pane, 1}});
  ASSERT_TRUE(mesh);
  for (const Facet& f : mesh->facets) {
    if (f.material != 0)
      continue;
    double longest = 0, farthest = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const glm::dvec3 p = f.corner[k] + mesh->origin;
      longest = std::max(longest, glm::distance(f.corner[k], f.corner[(k + 1) % 3]));
      farthest = std::max(farthest, std::min(glm::distance(p, {0, 0, 1}), glm::distance(p, {2, 0, 1})));
    }
    if (farthest < 0.2) {
      EXPECT_LE(longest, std::max(1.0 / 16, farthest) + 1e-6);
    }
  }
  EXPECT_LE(longest_on_pane(*mesh), 0.2501);
  EXPECT_GT(facets_of(*mesh, 0), 30u);
}

TEST(NearPanes, a_sill_that_goes_on_beyond_its_pane_has_small_facets_beside_it_too) {
  const PaneAndSills s(0.4, 0.05);
  const auto mesh = mesh_surfaces(s.room, {.edge_m = 2.0, .panes = {&s.pane, 1}});
  ASSERT_TRUE(mesh);
  double longest = 0;
  for (const Facet& f : mesh->facets) {
    const auto y = [&](std::size_t k) { return f.corner[k % 3].y + mesh->origin.y; };
    for (std::size_t k = 0; f.material == 0 && k < 3; ++k)
      if (std::min({y(0), y(1), y(2)}) <= 0.0 && std::max({y(0), y(1), y(2)}) >= 0.0) // the pane stands on it
        longest = std::max(longest, glm::distance(f.corner[k], f.corner[(k + 1) % 3]));
  }
  EXPECT_LE(longest, 0.36) << "a square of a quarter of the pane's width";
}

TEST(NearPanes, facets_of_a_sill_are_as_short_as_the_shadow_of_the_frame_below_a_pane) {
  PaneAndSills s;
  for (std::size_t k : {0, 3})
    s.pane.corners[k].z = 1.1;
  const auto mesh = mesh_surfaces(s.room, {.edge_m = 2.0, .panes = {&s.pane, 1}});
  ASSERT_TRUE(mesh);
  EXPECT_LE(longest_on_pane(*mesh), 0.0701) << "a frame of 10 cm";
  EXPECT_LT(facets_of(*mesh, 0), 600u);
}

TEST(NearPanes, facets_far_above_a_sill_are_as_elsewhere) {
  PaneAndSills s;
  s.room.materials.resize(5);
  for (const double z : {1.0, 2.0}) // the lower and the upper half of a reveal, the pane 0.8 x 2 m
    add_quad(s.room, {0, -0.4, z}, {0, -0.4, z + 1}, {0, 0, z + 1}, {0, 0, z}, z < 1.5 ? 3 : 4);
  for (std::size_t k : {1, 2})
    s.pane.corners[k].z = 3.0;
  for (std::size_t k : {2, 3})
    s.pane.corners[k].x = 0.8;
  const auto with = mesh_surfaces(s.room, {.edge_m = 2.0, .panes = {&s.pane, 1}}),
             without = mesh_surfaces(s.room, {.edge_m = 2.0});
  ASSERT_TRUE(with && without);
  const auto above = [](const SurfaceMesh& mesh) {
    return std::ranges::count_if(mesh.facets, [&](const Facet& f) {
      return f.material >= 3 && (f.corner[0].z + f.corner[1].z + f.corner[2].z) / 3 + mesh.origin.z > 2.2;
    });
  };
  EXPECT_LE(above(*with), above(*without) + 4);
}

TEST(NearPanes, many_panes_bring_a_thousand_facets_at_most) {
  Room room;
  room.materials.resize(1);
  std::vector<Aperture> panes;
  for (int k = 0; k < 40; ++k) {
    const double x = 3.0 * k;
    add_quad(room, {x, -0.4, 1}, {x + 2, -0.4, 1}, {x + 2, 0, 1}, {x, 0, 1});
    panes.push_back({{{x, 0, 1.1}, {x, 0, 2}, {x + 2, 0, 2}, {x + 2, 0, 1.1}}, {0, -1, 0}, Rgb(1.0f), 0.0f});
  }
  const auto one = mesh_surfaces(room, {.edge_m = 2.0, .panes = std::span(panes).first(1)}),
             all = mesh_surfaces(room, {.edge_m = 2.0, .panes = panes}), without = mesh_surfaces(room, {.edge_m = 2.0});
  ASSERT_TRUE(one && all && without);
  EXPECT_LE(all->facets.size(), without->facets.size() + 1000);
  EXPECT_GT(40 * (one->facets.size() - without->facets.size()), 2000u) << "or they are not as many anyway";
}

TEST(NearPanes, a_floor_that_begins_at_a_pane_is_no_sill) {
  const PaneAndSills s(0.6);
  const auto without = mesh_surfaces(s.room, {.edge_m = 0.6});
  const auto with = mesh_surfaces(s.room, {.edge_m = 0.6, .panes = {&s.pane, 1}});
  ASSERT_TRUE(without && with);
  EXPECT_EQ(with->facets.size(), without->facets.size());
}

TEST(NearPanes, a_plane_that_begins_outside_and_reaches_little_inside_is_no_sill) {
  const PaneAndSills s(0.1, 0.05);
  const auto with = mesh_surfaces(s.room, {.edge_m = 2.0, .panes = {&s.pane, 1}}),
             without = mesh_surfaces(s.room, {.edge_m = 2.0});
  ASSERT_TRUE(with && without);
  EXPECT_EQ(facets_of(*with, 0), facets_of(*without, 0)) << "a window's frame";
}

TEST(NearPanes, reveals_count_beside_a_sill_and_not_without_one) {
  PaneAndSills s;
  s.room.materials.resize(4);
  add_quad(s.room, {0, -0.4, 1}, {0, -0.4, 2}, {0, 0, 2}, {0, 0, 1}, 3);
  const auto beside = mesh_surfaces(s.room, {.edge_m = 2.0, .panes = {&s.pane, 1}});
  Room reveal;
  reveal.materials.resize(1);
  add_quad(reveal, {0, -0.4, 1}, {0, -0.4, 2}, {0, 0, 2}, {0, 0, 1}); // as beside a skylight: nothing stands there
  const auto alone = mesh_surfaces(reveal, {.edge_m = 2.0, .panes = {&s.pane, 1}}),
             without = mesh_surfaces(reveal, {.edge_m = 2.0});
  ASSERT_TRUE(beside && alone && without);
  EXPECT_EQ(alone->facets.size(), without->facets.size());
  EXPECT_GT(facets_of(*beside, 3), 2 * without->facets.size());
}

} // namespace
} // namespace daylit::radiosity
