// Joints that do not close.

#include "scene/room/gaps.h"

#include <gtest/gtest.h>

#include "scene/room/aperture.h"
#include "test_rooms.h"

namespace daylit {
namespace {

/// 4 x 5 x 3 m with a hole of 2 m2; the floor reaches beyond the walls, `gap` metres below them.
test::RoomBuilder room_above_its_floor(double gap) {
  test::RoomBuilder b;
  const std::uint32_t grey = b.material("grey"), floor = b.material("floor");
  b.box({0, 0, 0}, {4, 5, 3}, grey, 63 & ~(4u | 16u));
  b.wall_with_hole(0, 0, 4, 0, 3, 1, 3, 1, 2, grey);
  b.quad({-0.3, -0.3, -gap}, {4.3, -0.3, -gap}, {4.3, 5.3, -gap}, {-0.3, 5.3, -gap}, floor);
  return b;
}

Gaps gaps_of(const Room& room, double widest_m = kWidestGap_m) {
  const auto rays = RayScene::build(room);
  const auto apertures = find_apertures(room, *rays);
  EXPECT_TRUE(apertures);
  const auto gaps = find_gaps(room, apertures->list, widest_m);
  EXPECT_TRUE(gaps);
  return *gaps;
}

TEST(Gaps, joined_room_has_none) {
  EXPECT_TRUE(gaps_of(test::room_with_hole().room).list.empty());
  EXPECT_TRUE(gaps_of(test::room_with_hole({1e5, -2e5, 30}).room).list.empty());
  EXPECT_TRUE(gaps_of(room_above_its_floor(0).room).list.empty());
}

TEST(Gaps, walls_that_end_above_the_floor_are_found_with_length_and_area) {
  for (const double gap : {0.0005, 0.003, 0.019}) {
    const Gaps gaps = gaps_of(room_above_its_floor(gap).room);
    EXPECT_NEAR(gaps.length_m, 18.0, 0.3) << gap;
    EXPECT_NEAR(gaps.widest_m, gap, 1e-9);
    EXPECT_NEAR(gaps.area_m2, 18.0 * gap, 0.3 * gap);
  }
  EXPECT_TRUE(gaps_of(room_above_its_floor(0.025).room).list.empty()) << "that is no joint";
}

TEST(Gaps, closed_ones_are_gone_and_narrower_bounds_leave_them) {
  Room room = room_above_its_floor(0.003).room;
  close_gaps(room, gaps_of(room, 0.002));
  EXPECT_NEAR(gaps_of(room).length_m, 18.0, 0.3);
  const std::size_t before = room.triangles.size();
  close_gaps(room, gaps_of(room, 0.003));
  EXPECT_TRUE(gaps_of(room).list.empty());
  EXPECT_EQ(room.triangles.size(), before + 2 * 6); // the wall with the hole ends in three pieces
}

TEST(Gaps, furniture_above_the_floor_lets_no_daylight_in) {
  test::RoomBuilder b = test::room_with_hole();
  b.box({1, 2, 0.003}, {2, 3, 0.8}, 0);
  b.box({2.004, 2, 0.003}, {3, 3, 0.8}, 0);
  EXPECT_TRUE(gaps_of(b.room).list.empty());
}

TEST(Gaps, pane_smaller_than_its_hole_leaves_a_gap_around_it) {
  test::RoomBuilder b = test::room_with_hole();
  const std::uint32_t glass = b.material("Window", Rgb(0.0f), Rgb(0.8f));
  b.quad({1.004, 0, 1.004}, {2.996, 0, 1.004}, {2.996, 0, 1.996}, {1.004, 0, 1.996}, glass);
  const Gaps gaps = gaps_of(b.room);
  EXPECT_NEAR(gaps.length_m, 6.0, 0.1);
  EXPECT_NEAR(gaps.widest_m, 0.004, 1e-9);
}

} // namespace
} // namespace daylit
