// Planes that are for a table make probes with light of their own above it alone.

#include <algorithm>

#include <gtest/gtest.h>

#include "precompute/far_probes.h"
#include "precompute/probes.h"
#include "scene/volume/interpolated_probes.h"
#include "tests/scene/test_rooms.h"

namespace daylit::precompute {
namespace {

using test::RoomBuilder;

/// 4 x 5 x 3 m with an open front, a table at 0.75 m and, in front of it, a screen from floor to ceiling between two
/// planes that stand beside the edge of the table.
struct Case {
  Room room;
  RayScene scene;
  Apertures apertures;
  Planes planes;
  ProbeSet grid, full;

  explicit Case(bool screen) {
    RoomBuilder b;
    const auto grey = b.material("grey");
    b.box({0, 0, 0}, {4, 5, 3}, grey, 63 & ~4u);
    b.box({1, 2, 0.72}, {2, 3, 0.75}, grey);
    if (screen)
      b.quad({1.05, 0.3, 0}, {1.05, 1.9, 0}, {1.05, 1.9, 3}, {1.05, 0.3, 3}, grey);
    room = b.room;
    scene = *RayScene::build(room);
    apertures = *find_apertures(room, scene);
    const Bounds bounds = room.bounds();
    const Planes near = planes_near(*standing_faces(room), bounds);
    planes = grid_planes(bounds, glm::ivec3(0), 0.4, {}, near);
    grid = *make_grid(bounds, glm::ivec3(0), 0.4, {}, near);
    mark_air(grid, scene, apertures.list);
    full = grid;
    interpolate_far_probes(planes, scene, apertures.list, grid);
  }
  glm::dvec3 position(std::size_t i) const { return grid.origin + glm::dvec3(grid.positions[i]); }
};

TEST(FarProbes, are_interpolated_and_those_above_the_table_are_not) {
  const Case c(false);
  ASSERT_TRUE(interpolated_probes(c.grid));
  EXPECT_LT(10 * std::ranges::count(c.grid.valid, 1), 7 * std::ranges::count(c.full.valid, 1));
  std::size_t above = 0;
  for (std::size_t i = 0; i < c.grid.size(); ++i) {
    EXPECT_EQ(c.full.valid[i], c.grid.valid[i] || c.grid.interpolated[i]) << "no probe of the air is lost";
    const glm::dvec3 p = c.position(i);
    if (c.full.valid[i] && p.x > 1 && p.x < 2 && p.y > 2 && p.y < 3 && p.z > 0.75 && p.z < 1.2) {
      EXPECT_TRUE(c.grid.valid[i]) << p.x << ' ' << p.y << ' ' << p.z;
      ++above;
    }
  }
  EXPECT_GT(above, 60u);
}

TEST(FarProbes, never_lie_between_two_that_do_not_see_each_other) {
  const Case c(true);
  const auto list = interpolated_probes(c.grid);
  ASSERT_TRUE(list);
  EXPECT_GT(list->size(), 100u);
  for (const InterpolatedProbe& p : *list)
    EXPECT_TRUE(open_between(c.position(p.a), c.position(p.b), c.scene, c.apertures.list));
}

TEST(FarProbes, are_as_many_as_the_plan_counts) {
  const Case c(false);
  const auto in_air = static_cast<double>(std::ranges::count(c.full.valid, 1)) / static_cast<double>(c.grid.size());
  EXPECT_NEAR(static_cast<double>(probes_wanted(c.planes)) * in_air,
              static_cast<double>(std::ranges::count(c.grid.valid, 1)), 0.1 * static_cast<double>(c.grid.size()));
}

} // namespace
} // namespace daylit::precompute
