// Light only where it is asked for: the room around a point, a box, and the sketch that keeps a building's sky small.

#include <cmath>
#include <cstdio>

#include <gtest/gtest.h>

#include "precompute/cheaper_bake.h"
#include "precompute/detail/sun_metric.h"
#include "precompute/planned_bake.h"
#include "precompute/probes.h"
#include "precompute/room_around.h"
#include "precompute/room_frame.h"
#include "tests/scene/test_rooms.h"

namespace daylit::precompute {
namespace {

/// Two rooms of 4 x 4 x 3 m with a window each, joined by a door of 0.9 x 2 m.
Room two_rooms() {
  test::RoomBuilder b;
  const auto wall = b.material("wall");
  b.box({0, 0, 0}, {4, 4, 3}, wall, 63 & ~(4u | 8u));
  b.box({0, 4, 0}, {4, 8, 3}, wall, 63 & ~(4u | 8u));
  b.wall_with_hole(0.0, 0, 4, 0, 3, 1, 3, 1, 2, wall);
  b.wall_with_hole(4.0, 0, 4, 0, 3, 0.2, 1.1, 0, 2, wall);
  b.wall_with_hole(8.0, 0, 4, 0, 3, 1, 3, 1, 2, wall);
  return b.room;
}

TEST(RoomAround, ends_at_the_walls_and_not_behind_the_door) {
  for (const glm::dvec3 p : {glm::dvec3(2.5, 1.5, 1.2), glm::dvec3(3.5, 0.5, 2.5)}) {
    const auto box = room_around(two_rooms(), p);
    ASSERT_TRUE(box) << box.error().message();
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(box->min[axis], 0.0, 0.02);
      EXPECT_NEAR(box->max[axis], axis == 2 ? 3.0 : 4.0, 0.02);
    }
  }
  EXPECT_FALSE(room_around(two_rooms(), {20, 20, 20}));
  const auto on_floor = room_around(two_rooms(), {2, 2, 0});
  ASSERT_FALSE(on_floor);
  EXPECT_NE(on_floor.error().message().find("lies on a face"), std::string::npos);
}

TEST(AirAround, is_the_building_without_its_ground_and_all_of_the_model_where_a_point_stands_outdoors) {
  test::RoomBuilder b;
  b.room = two_rooms();
  b.quad({-9, -9, -0.1}, {12, -9, -0.1}, {12, 15, -0.1}, {-9, 15, -0.1}, 0);
  const RayScene scene = *RayScene::build(b.room);
  const auto apertures = find_apertures(two_rooms(), *RayScene::build(two_rooms()))->list;
  std::vector<glm::dvec3> points{{2, 2, 1}, {1, 3, 2}, {3, 6, 1}, {2.5, 7, 2}};
  const Bounds air = air_around(b.room, scene, apertures, points);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(air.min[axis], 0.0, 1e-5);
    EXPECT_NEAR(air.max[axis], glm::dvec3(4, 8, 3)[axis], 1e-5);
  }
  points.emplace_back(10, 10, 5);
  EXPECT_NEAR(air_around(b.room, scene, apertures, points).min.x, -9.0, 1e-9);
}

TEST(Box, has_all_probes_and_they_are_in_the_air_without_an_opening_beside_them) {
  const RoomFile room{two_rooms(), {}, "two rooms"};
  BakeOptions options;
  options.target_facets = 200;
  options.gather_rays = 64;
  options.visibility_rays = 512;
  options.spacing_m = 0.25;
  options.box = {{1.5, 1.5, 1}, {2.5, 2.5, 2}};
  BakeReport report;
  const auto volume = bake_room(
      room, *SkyPartition::uniform(16), options, [](const std::string&, double) { return true; }, report);
  ASSERT_TRUE(volume) << volume.error().message();
  EXPECT_EQ(report.probes_valid, report.probes);
  for (const glm::vec3& p : volume->probes.positions)
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_GE(volume->probes.origin[axis] + double(p[axis]), options.box.min[axis] - 1e-6);
      EXPECT_LE(volume->probes.origin[axis] + double(p[axis]), options.box.max[axis] + 1e-6);
    }
}

/// Two rooms on 300 m of ground, of which points all over it hardly meet the air.
Room on_large_ground() {
  test::RoomBuilder b;
  b.room = two_rooms();
  b.quad({-150, -150, -0.1}, {150, -150, -0.1}, {150, 150, -0.1}, {-150, 150, -0.1}, 0);
  return b.room;
}

TEST(LargeGround, points_in_the_house_are_in_the_air) {
  // In the frame of the bake, whose longest side is 8 units.
  Room room = on_large_ground();
  constexpr double kUnit = 8.0 / 300.0;
  for (glm::dvec3& v : room.vertices)
    v *= kUnit;
  const RayScene scene = *RayScene::build(room);
  std::vector<glm::dvec3> at{{2, 2, 1}, {3.8, 7.8, 0.2}, {2, 2, 3.5}, {20, 20, 1}};
  for (glm::dvec3& p : at)
    p *= kUnit;
  const auto points = make_points(at, room.bounds(), scene, find_apertures(room, scene)->list);
  ASSERT_TRUE(points) << points.error().message();
  EXPECT_EQ(points->valid, (std::vector<std::uint8_t>{1, 1, 0, 0}));
}

Result<PlannedBake> bake_asked(const Room& room, const PlanRequest& asked) {
  PlanRequest request = asked;
  request.max_error = 0.3;
  return bake_to_error(
      {room, {}, "room"}, request, nullptr, [](const std::string&, double) { return true; }, [](const std::string&) {});
}

TEST(LargeGround, probes_stand_in_the_house_alone) {
  const auto baked = bake_asked(on_large_ground(), {});
  ASSERT_TRUE(baked) << baked.error().message();
  EXPECT_EQ(baked->measured.rooms.size(), 2u);
  const auto& probes = baked->volume.probes;
  for (const glm::vec3& p : probes.positions)
    for (int axis = 0; axis < 2; ++axis) {
      EXPECT_GE(probes.origin[axis] + double(p[axis]), -1e-3);
      EXPECT_LE(probes.origin[axis] + double(p[axis]), (axis == 0 ? 4.0 : 8.0) + 1e-3);
    }
  EXPECT_GT(std::ranges::count(probes.valid, 1), 500);
}

TEST(Box, without_air_or_light_says_so) {
  const auto expect_error = [](const Result<PlannedBake>& baked, const char* part) {
    ASSERT_FALSE(baked) << part;
    EXPECT_NE(baked.error().message().find(part), std::string::npos) << baked.error().message();
  };
  test::RoomBuilder b;
  b.room = two_rooms();
  b.box({1, 1, 1}, {2, 2, 1.1}, 0); // a table's board
  PlanRequest in_board, points_in_board;
  in_board.box = {{1.01, 1.01, 1.01}, {1.99, 1.99, 1.09}};
  points_in_board.points = {{1.5, 1.5, 1.05}};
  expect_error(bake_asked(b.room, in_board), "no point of the box can be reached");
  expect_error(bake_asked(b.room, points_in_board), "none of the points can be reached");
  // A pane 5 mm before a wall that was not cut open.
  test::RoomBuilder closed;
  closed.box({0, 0, 0}, {4, 4, 3}, closed.material("wall"));
  closed.quad({1, 0.005, 1}, {3, 0.005, 1}, {3, 0.005, 2}, {1, 0.005, 2}, closed.material("window"));
  expect_error(bake_asked(closed.room, {}), "no daylight comes in");
}

TEST(Building, that_fits_at_no_error_is_offered_one_of_its_rooms) {
  const RoomFile room{two_rooms(), {}, "two rooms"};
  const Progress quiet = [](const std::string&, double) { return true; };
  PlanRequest request;
  request.max_error = 0.1;
  const auto planned = plan_bake(room, request, quiet);
  ASSERT_TRUE(planned) << planned.error().message();
  request.memory_bytes = 1e6;
  const Error offer = with_offer({ErrorCode::limit_exceeded, "too large", "--memory", "else"}, room,
                                 planned->calibration, request, quiet);
  double x = 0, y = 0, z = 0;
  ASSERT_EQ(std::sscanf(offer.hint.c_str(), "--inside %lf,%lf,%lf bakes one of its 2 rooms; else", &x, &y, &z), 3)
      << offer.hint;
  EXPECT_TRUE(room_around(room.room, {x, y, z}));
}

TEST(Grid, of_too_many_probes_is_refused_before_it_is_laid_out) {
  PlanRequest fine;
  fine.spacing_m = 1e-4;
  const auto baked = bake_asked(two_rooms(), fine);
  ASSERT_FALSE(baked);
  EXPECT_NE(baked.error().message().find("4 million probes"), std::string::npos);
}

/// Sources 0 .. 5, node j lights sources j mod 6 and (j + 1) mod 6.
detail::SunColumns columns_of(std::size_t nodes) {
  detail::SunColumns c{.sources = 6, .node = {}, .begin = {0}, .source = {}, .value = {}};
  for (std::size_t j = 0; j < nodes; ++j) {
    c.node.push_back(static_cast<std::int32_t>(j));
    for (const std::size_t s : {j % 6, (j + 1) % 6}) {
      c.source.push_back(static_cast<std::uint32_t>(s));
      c.value.push_back(0.5f + 0.1f * static_cast<float>(j % 7));
    }
    c.begin.push_back(c.source.size());
  }
  return c;
}

/// sum over nodes of d^2 H_s H_t, and the same from the sketch.
void expect_covariance(std::size_t nodes, double within) {
  const detail::SunColumns c = columns_of(nodes);
  std::vector<float> weight;
  for (std::size_t j = 0; j < nodes; ++j)
    weight.push_back(1.0f + 0.01f * static_cast<float>(j % 11));
  const detail::SunMetric metric(c, weight, 1024);
  std::vector<double> exact(36, 0.0);
  for (std::size_t j = 0; j < nodes; ++j)
    for (std::size_t a = c.begin[j]; a < c.begin[j + 1]; ++a)
      for (std::size_t b = c.begin[j]; b < c.begin[j + 1]; ++b)
        exact[c.source[a] * 6 + c.source[b]] +=
            double(weight[j]) * double(weight[j]) * double(c.value[a]) * double(c.value[b]);
  for (std::size_t s = 0; s < 6; ++s)
    for (std::size_t t = 0; t < 6; ++t) {
      double sketch = 0;
      for (std::size_t k = 0; k < metric.columns; ++k)
        sketch += double(metric.sample[s * metric.columns + k]) * double(metric.sample[t * metric.columns + k]);
      sketch *= double(metric.sigma[s]) * double(metric.sigma[t]);
      EXPECT_NEAR(sketch, exact[s * 6 + t], within * std::sqrt(exact[s * 7] * exact[t * 7])) << s << " " << t;
    }
}

TEST(SunMetric, is_exact_with_few_nodes_and_close_with_many) {
  expect_covariance(600, 1e-5);
  expect_covariance(12000, 0.15); // 4 / sqrt(1,024)
}

} // namespace
} // namespace daylit::precompute
