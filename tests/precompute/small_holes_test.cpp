// Which holes are small, and where probes stand around them.

#include "precompute/small_holes.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "tests/scene/test_rooms.h"

namespace daylit::precompute {
namespace {

using test::RoomBuilder;

/// 3 x 6 x 2.5 m with a window in the wall y = 0, divided by a wall at y = 3 with a square hole whose low corner is
/// (1, 3, 1).
RoomBuilder divided(double hole_m) {
  RoomBuilder b;
  const auto wall = b.material("wall");
  b.box({0, 0, 0}, {3, 6, 2.5}, wall, 63 & ~4u);
  b.wall_with_hole(0, 0, 3, 0, 2.5, 0.5, 2.5, 1, 2, wall);
  b.wall_with_hole(3, 0, 3, 0, 2.5, 1, 1 + hole_m, 1, 1 + hole_m, wall);
  return b;
}

std::vector<SmallHole> holes_of(const Room& room) {
  const auto rays = RayScene::build(room);
  const auto apertures = find_apertures(room, *rays);
  return small_holes(room, *rays, apertures->list);
}

TEST(SmallHoles, have_air_on_both_sides_and_are_small) {
  const auto found = holes_of(divided(0.1).room);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NEAR(std::abs(found[0].normal.y), 1.0, 1e-6);
  EXPECT_NEAR(found[0].box.min.x, 1.0, 1e-6);
  EXPECT_NEAR(found[0].box.max.z, 1.1, 1e-6);
  EXPECT_TRUE(holes_of(divided(0.8).room).empty()) << "a hatch";
}

TEST(SmallHoles, are_neither_filled_nor_glazed_nor_blocked) {
  for (const char* material : {"wall", "window"}) {
    RoomBuilder b = divided(0.1);
    const auto pane = b.material(material);
    b.quad({1, 3, 1}, {1.1, 3, 1}, {1.1, 3, 1.1}, {1, 3, 1.1}, pane);
    EXPECT_TRUE(holes_of(b.room).empty()) << material;
  }
  RoomBuilder b = divided(0.1);
  b.quad({0, 3.2, 0}, {3, 3.2, 0}, {3, 3.2, 2.5}, {0, 3.2, 2.5}, 0);
  EXPECT_TRUE(holes_of(b.room).empty());
}

TEST(SmallHoles, have_convex_outlines_relative_to_a_point) {
  const auto outlines = convex_outlines(holes_of(divided(0.1).room), {1, 3, 1});
  ASSERT_EQ(outlines.size(), 1u);
  ASSERT_EQ(outlines[0].size(), 4u);
  for (const glm::dvec3& c : outlines[0]) {
    EXPECT_NEAR(std::abs(c.x - 0.05), 0.05, 1e-6);
    EXPECT_NEAR(c.y, 0.0, 1e-6);
    EXPECT_NEAR(std::abs(c.z - 0.05), 0.05, 1e-6);
  }
}

TEST(SmallHoles, have_planes_around_them_and_none_through_them) {
  Planes planes;
  add_planes_near(holes_of(divided(0.1).room), planes);
  const auto holds = [&](std::size_t axis, double at) {
    return std::ranges::any_of(planes[axis], [&](const ProbePlane& p) { return std::abs(p.at - at) < 1e-6; });
  };
  for (const double d : {0.05, 0.56}) {
    EXPECT_TRUE(holds(1, 3 - d) && holds(1, 3 + d)) << d;
  }
  for (const std::size_t axis : {0u, 2u}) {
    EXPECT_TRUE(holds(axis, 0.97) && holds(axis, 1.13)) << axis;
    EXPECT_TRUE(std::ranges::none_of(planes[axis], [](const ProbePlane& p) { return p.at > 0.98 && p.at < 1.12; }));
    EXPECT_TRUE(std::ranges::all_of(planes[axis], [](const ProbePlane& p) { return !p.where.empty(); }));
  }
}

} // namespace
} // namespace daylit::precompute
