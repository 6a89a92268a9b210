#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "precompute/probes.h"
#include "tests/radiosity/rooms.h"
#include "tests/scene/test_rooms.h"

namespace daylit::precompute {
namespace {

using testing::add_box;
using testing::room_with_window_hole;

struct Setting {
  RayScene scene;
  std::vector<Aperture> apertures;
};

Setting setting_of(const Room& room) {
  Setting s{*RayScene::build(room), {}};
  const auto found = find_apertures(room, s.scene);
  EXPECT_TRUE(found);
  s.apertures = found->list;
  return s;
}

bool valid_at(const ProbeSet& grid, const glm::dvec3& p) {
  std::size_t best = 0;
  double distance = 1e300;
  for (std::size_t i = 0; i < grid.size(); ++i)
    if (const double d = glm::distance(grid.origin + glm::dvec3(grid.positions[i]), p); d < distance) {
      distance = d;
      best = i;
    }
  return grid.valid[best] != 0;
}

TEST(ProbeGrid, default_spacing_is_an_upper_bound_on_every_axis) {
  const Room room = room_with_window_hole(0.5f);
  const auto grid = make_grid(room.bounds(), glm::ivec3(0), 0.3);
  ASSERT_TRUE(grid);
  for (int k = 0; k < 3; ++k)
    EXPECT_LE(grid->spacing[k], 0.3 + 1e-12);
  EXPECT_EQ(grid->size(), static_cast<std::size_t>(grid->count.x * grid->count.y * grid->count.z));
}

TEST(ProbeGrid, requested_counts_are_kept) {
  const auto grid = make_grid(room_with_window_hole(0.5f).bounds(), {8, 8, 8}, 0.3);
  ASSERT_TRUE(grid);
  EXPECT_EQ(grid->size(), 512u);
}

TEST(ProbeGrid, kilometres_are_refused_instead_of_filling_memory) {
  Bounds huge;
  huge.include({0, 0, 0});
  huge.include({4000, 5000, 2800});
  const auto grid = make_grid(huge, glm::ivec3(0), 0.3);
  ASSERT_FALSE(grid);
  EXPECT_EQ(grid.error().code, ErrorCode::limit_exceeded);
}

TEST(MarkAir, inside_of_furniture_and_a_windowless_closet_stay_invalid_whatever_the_face_orientation) {
  for (const bool flipped : {false, true}) {
    Room room = room_with_window_hole(0.5f);
    add_box(room, {1, 1, 0}, {2, 2, 1.2}, 0b111110u, flipped);   // furniture standing on the floor
    add_box(room, {2.5, 3, 0}, {4, 5, 2.8}, 0b010100u, flipped); // closet in the corner: its west and south walls
    const Setting s = setting_of(room);
    auto grid = *make_grid(room.bounds(), glm::ivec3(0), 0.3);
    mark_air(grid, s.scene, s.apertures);
    EXPECT_TRUE(valid_at(grid, {2, 2.5, 1.4}));
    EXPECT_TRUE(valid_at(grid, {0.1, 4.9, 2.7}));
    EXPECT_FALSE(valid_at(grid, {1.5, 1.5, 0.6}));
    EXPECT_FALSE(valid_at(grid, {3.3, 4, 1.4}));
  }
}

TEST(MarkAir, outdoors_is_not_the_air_of_an_l_shaped_room) {
  Room room = testing::grey_room(0.5f);
  // L: 4 x 2 m plus 2 x 2 m; window pane in the south wall.
  room.materials.push_back({"window", Rgb(0.0f), Rgb(1.0f), true});
  const auto wall = [&](double x0, double y0, double x1, double y1, std::uint32_t material = 0) {
    testing::add_quad(room, {x0, y0, 0}, {x1, y1, 0}, {x1, y1, 2.5}, {x0, y0, 2.5}, material);
  };
  wall(0, 0, 4, 0, 1);
  wall(4, 0, 4, 2);
  wall(4, 2, 2, 2);
  wall(2, 2, 2, 4);
  wall(2, 4, 0, 4);
  wall(0, 4, 0, 0);
  for (const double z : {0.0, 2.5}) {
    testing::add_quad(room, {0, 0, z}, {4, 0, z}, {4, 2, z}, {0, 2, z});
    testing::add_quad(room, {0, 2, z}, {2, 2, z}, {2, 4, z}, {0, 4, z});
  }
  const Setting s = setting_of(room);
  // An odd number of probes has some in the planes x = 2 and y = 2 of the walls.
  for (const glm::ivec3& count :
       {glm::ivec3(0), glm::ivec3(5), glm::ivec3(9), glm::ivec3(15), glm::ivec3(21, 21, 10), glm::ivec3(12, 9, 4)}) {
    auto grid = *make_grid(room.bounds(), count, 0.3);
    mark_air(grid, s.scene, s.apertures);
    EXPECT_TRUE(valid_at(grid, {3.5, 1, 1}));
    EXPECT_TRUE(valid_at(grid, {1, 3.5, 1}));
    EXPECT_FALSE(valid_at(grid, {3.3, 3.3, 1}));
  }
  const auto points = make_points({{1, 3.5, 1}, {3.3, 3.3, 1}, {2, -1, 1}}, room.bounds(), s.scene, s.apertures);
  ASSERT_TRUE(points);
  EXPECT_EQ(points->valid, (std::vector<std::uint8_t>{1, 0, 0}));
}

TEST(MarkAir, probes_in_the_plane_of_a_slanted_wall_do_not_lead_through_it) {
  Room room = testing::grey_room(0.5f);
  // A triangle: every grid has probes in the plane of its long wall, and half of its box is outdoors.
  room.materials.push_back({"window", Rgb(0.0f), Rgb(1.0f), true});
  const auto wall = [&](double x0, double y0, double x1, double y1, std::uint32_t material = 0) {
    testing::add_quad(room, {x0, y0, 0}, {x1, y1, 0}, {x1, y1, 2.5}, {x0, y0, 2.5}, material);
  };
  wall(0, 0, 4, 0, 1);
  wall(4, 0, 0, 4);
  wall(0, 4, 0, 0);
  for (const double z : {0.0, 2.5})
    testing::add_quad(room, {0, 0, z}, {4, 0, z}, {2, 2, z}, {0, 4, z});
  const Setting s = setting_of(room);
  for (int n = 3; n < 24; ++n) {
    auto grid = *make_grid(room.bounds(), {n, n, 5}, 0.3);
    mark_air(grid, s.scene, s.apertures);
    std::size_t outdoors = 0, inside = 0;
    for (std::size_t i = 0; i < grid.size(); ++i) {
      const glm::dvec3 p = grid.origin + glm::dvec3(grid.positions[i]);
      outdoors += grid.valid[i] && p.x + p.y > 4.0001;
      inside += !grid.valid[i] && p.x + p.y < 3.9999;
    }
    EXPECT_EQ(outdoors, 0u) << n;
    EXPECT_EQ(inside, 0u) << n;
  }
}

TEST(MarkAir, rooms_joined_by_a_door_and_a_stairwell_are_air_and_a_sealed_one_is_not) {
  // Below: a room with a pane, a door in x = 3 to the next, from there a stairwell up; beside that upper room one
  // without any opening.
  Room room = testing::grey_room(0.5f);
  room.materials.push_back({"window", Rgb(0.0f), Rgb(1.0f), true});
  const auto wall = [&](double x0, double y0, double x1, double y1, double z0, double z1, std::uint32_t material = 0) {
    testing::add_quad(room, {x0, y0, z0}, {x1, y1, z0}, {x1, y1, z1}, {x0, y0, z1}, material);
  };
  const auto flat = [&](double x0, double y0, double x1, double y1, double z) {
    testing::add_quad(room, {x0, y0, z}, {x1, y0, z}, {x1, y1, z}, {x0, y1, z});
  };
  wall(0, 0, 3, 0, 0, 2.5, 1);
  wall(3, 0, 6, 0, 0, 2.5);
  wall(0, 0, 6, 0, 2.5, 5);
  for (const double x : {0.0, 6.0})
    wall(x, 0, x, 4, 0, 5);
  wall(0, 4, 6, 4, 0, 5);
  wall(3, 0, 3, 1.5, 0, 2.5); // beside and above the door
  wall(3, 2.5, 3, 4, 0, 2.5);
  wall(3, 1.5, 3, 2.5, 2, 2.5);
  wall(3, 0, 3, 4, 2.5, 5);
  flat(0, 0, 6, 4, 0);
  flat(0, 0, 6, 4, 5);
  flat(0, 0, 4.5, 4, 2.5); // around the stairwell
  flat(5.5, 0, 6, 4, 2.5);
  flat(4.5, 0, 5.5, 1, 2.5);
  flat(4.5, 3, 5.5, 4, 2.5);
  const Setting s = setting_of(room);
  auto grid = *make_grid(room.bounds(), glm::ivec3(0), 0.3);
  mark_air(grid, s.scene, s.apertures);
  for (const glm::dvec3& p : {glm::dvec3(0.2, 0.2, 0.2), {5.8, 3.8, 0.2}, {3.3, 3.8, 4.8}, {5.8, 0.2, 2.8}})
    EXPECT_TRUE(valid_at(grid, p)) << p.x << " " << p.y << " " << p.z;
  for (const glm::dvec3& p : {glm::dvec3(0.2, 0.2, 2.8), {2.7, 3.8, 4.8}, {1.5, 2.0, 3.5}})
    EXPECT_FALSE(valid_at(grid, p)) << p.x << " " << p.y << " " << p.z;
}

TEST(MarkAir, room_behind_a_hole_of_10_cm_is_air_and_one_without_is_not) {
  for (const bool hole : {true, false}) {
    test::RoomBuilder b;
    const auto grey = b.material("grey"), pane = b.material("window");
    b.box({0, 0, 0}, {8, 4, 3}, grey, 63 & ~4u);
    b.quad({0, 0, 0}, {4, 0, 0}, {4, 0, 3}, {0, 0, 3}, pane);
    b.quad({4, 0, 0}, {8, 0, 0}, {8, 0, 3}, {4, 0, 3}, grey);
    const auto across_x = [&](double y0, double y1, double z0, double z1) {
      b.quad({4, y0, z0}, {4, y1, z0}, {4, y1, z1}, {4, y0, z1}, grey);
    };
    across_x(0, 4, 0, 1.43);
    across_x(0, 4, 1.53, 3);
    across_x(0, 2.07, 1.43, 1.53);
    across_x(hole ? 2.17 : 2.07, 4, 1.43, 1.53);
    const Setting s = setting_of(b.room);
    auto grid = *make_grid(b.room.bounds(), glm::ivec3(0), 0.4);
    mark_air(grid, s.scene, s.apertures);
    EXPECT_TRUE(valid_at(grid, {2, 2, 1.5}));
    EXPECT_EQ(valid_at(grid, {6, 2, 1.5}), hole);
  }
}

} // namespace
} // namespace daylit::precompute
