// Errors room by room: where they are measured, and what is told of them.

#include <cmath>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "precompute/planned_bake.h"
#include "precompute/room_points.h"
#include "scene/room/ray_scene.h"
#include "tests/scene/test_rooms.h"

namespace daylit::precompute {
namespace {

constexpr double kBehindDoor_m = 0.6; ///< how far a box may reach through it: it is made of what one sees

/// A room of 4 x 4 x 3 m with a table, and a smaller one of 4 x 3 x 3 m; a hole each, a door between.
Room two_rooms(const glm::dvec3& at) {
  test::RoomBuilder b;
  const auto wall = b.material("wall");
  b.box({0, 0, 0}, {4, 4, 3}, wall, 63 & ~(4u | 8u));
  b.box({0, 4, 0}, {4, 7, 3}, wall, 63 & ~(4u | 8u));
  b.wall_with_hole(0.0, 0, 4, 0, 3, 1, 3, 1, 2, wall);
  b.wall_with_hole(4.0, 0, 4, 0, 3, 0.2, 1.1, 0, 2, wall);
  b.wall_with_hole(7.0, 0, 4, 0, 3, 1, 2, 1, 2, wall);
  b.box({1, 1, 0}, {3, 2, 0.7}, wall);
  for (glm::dvec3& v : b.room.vertices)
    v += at;
  return b.room;
}

TEST(PointsByRoom, stand_in_each_room_as_many_close_to_surfaces_as_far_from_them_and_none_in_furniture) {
  const Room room = two_rooms({0, 0, 0});
  const auto rooms =
      points_by_room(room, room.bounds(), {{2, 3.5, 1.2}, {2, 6, 1}, {3.5, 0.5, 1}, {3.5, 3, 2}, {1, 3, 2.5}});
  ASSERT_TRUE(rooms) << rooms.error().message();
  ASSERT_EQ(rooms->size(), 2u);
  EXPECT_NEAR((*rooms)[0].box.min.y, 0.0, 0.02) << "the one with more points first";
  EXPECT_NEAR((*rooms)[1].box.max.y, 7.0, 0.02);
  for (const RoomPoints& r : *rooms)
    for (const int axis : {0, 2}) {
      EXPECT_NEAR(r.box.min[axis], 0.0, 0.02);
      EXPECT_NEAR(r.box.max[axis], axis == 0 ? 4.0 : 3.0, 0.02);
    }
  EXPECT_NEAR((*rooms)[0].box.max.y, 4.0, kBehindDoor_m);
  EXPECT_NEAR((*rooms)[1].box.min.y, 4.0, kBehindDoor_m);
  const Result<RayScene> rays = RayScene::build(room);
  for (const RoomPoints& r : *rooms) {
    EXPECT_EQ(r.points.size(), 30u);
    int close = 0;
    for (const glm::dvec3& p : r.points) {
      const auto off = static_cast<double>(rays->distance(rays->to_local(p), 5.0f));
      EXPECT_GE(off, 0.1);
      close += off < 0.2 ? 1 : 0;
      EXPECT_TRUE(p.x > r.box.min.x && p.y > r.box.min.y && p.z > r.box.min.z && p.x < r.box.max.x &&
                  p.y < r.box.max.y && p.z < r.box.max.z);
      EXPECT_FALSE(p.x > 1 && p.x < 3 && p.y > 1 && p.y < 2 && p.z < 0.7) << "in the table";
    }
    EXPECT_EQ(close, 10);
  }
}

TEST(ErrorSpread, percentile_lies_between_its_neighbours) {
  std::vector<double> errors;
  for (int i = 21; i > 0; --i)
    errors.push_back(i);
  const ErrorSpread spread = ErrorSpread::of(errors);
  EXPECT_NEAR(spread.mean, 11.0, 1e-12);
  EXPECT_NEAR(spread.percentile95, 20.0, 1e-12);
  EXPECT_EQ(spread.worst, 21.0);
  EXPECT_NEAR(ErrorSpread::of({2.0, 1.0}).percentile95, 1.95, 1e-12);
  EXPECT_EQ(ErrorSpread::of({}).skies, 0u);
}

TEST(RoomErrors, have_the_mesh_in_them_and_no_sun_that_hardly_reaches_the_room) {
  AuditReport report;
  report.sky = {{.sky = "overcast", .rooms = {{0.03, 5.0}}},
                {.sky = "sun", .is_sun = true, .rooms = {{0.03, 5.0}}},
                {.sky = "sun", .is_sun = true, .rooms = {{0.9, 0.4}}}};
  const RoomErrors errors = report.errors_in(0, 0.04);
  EXPECT_NEAR(errors.smooth.worst, 0.05, 1e-12);
  EXPECT_EQ(errors.sun.skies, 1u);
  EXPECT_NEAR(errors.sun.worst, 0.05, 1e-12);
}

TEST(RoomErrors, of_a_bake_are_told_room_by_room_in_the_coordinates_of_the_model) {
  const glm::dvec3 at(100, -50, 7);
  RoomFile file;
  file.room = two_rooms(at);
  PlanRequest request;
  request.max_error = 0.05;
  const auto baked = bake_to_error(
      file, request, nullptr, [](const std::string&, double) { return true; }, [](const std::string&) {});
  ASSERT_TRUE(baked) << baked.error().message();
  const Measured& m = baked->measured;
  ASSERT_EQ(m.rooms.size(), 2u);
  EXPECT_NEAR(m.rooms[0].box.max.y, at.y + 4.0, kBehindDoor_m);
  EXPECT_NEAR(m.rooms[1].box.max.y, at.y + 7.0, 0.02);
  for (const Measured::OfRoom& room : m.rooms) {
    EXPECT_EQ(room.errors.smooth.skies, 5u);
    EXPECT_GE(room.points, 26u);
    EXPECT_GE(room.errors.smooth.worst, m.mesh);
    EXPECT_LT(room.errors.smooth.worst, 4 * request.max_error);
    EXPECT_LE(room.errors.smooth.mean, room.errors.smooth.percentile95);
  }
  EXPECT_NE(to_text(baked->plan, m).find(" m around 102.00,-4"), std::string::npos) << to_text(baked->plan, m);
  const auto json = nlohmann::json::parse(to_json(*baked));
  EXPECT_EQ(json["measured"]["rooms"].size(), 2u);
  EXPECT_EQ(json["measured"]["rooms"][1]["smooth"]["worst"].get<double>(), m.rooms[1].errors.smooth.worst);
  EXPECT_EQ(json["audit"][0]["rooms"].size(), 2u);
}

} // namespace
} // namespace daylit::precompute
