// The generated rooms of daylit-bench rooms are what they say they are.

#include "bench/real_rooms.h"

#include <algorithm>
#include <map>

#include <glm/vector_relational.hpp>
#include <gtest/gtest.h>

#include "precompute/held_out.h"
#include "precompute/room_points.h"
#include "precompute/room_survey.h"

namespace daylit::bench {
namespace {

Result<RoomFile> file_of(const RealRoom& room) {
  return parse_obj_room(room.model.obj("rooms.mtl"), room.name,
                        [](const std::string&) { return Result<std::string>(real_rooms_mtl()); });
}

TEST(RealRooms, are_tight_and_have_the_openings_they_state) {
  const std::map<std::string, std::pair<int, int>> openings = {
      {"school", {7, 0}},  {"hall", {20, 0}},     {"home", {6, 0}}, {"louvres", {0, 36}},
      {"atrium", {22, 0}}, {"furnished", {2, 0}}, {"dim", {1, 0}}};
  for (const RealRoom& room : real_rooms()) {
    SCOPED_TRACE(room.name);
    auto file = file_of(room);
    ASSERT_TRUE(file) << file.error().message();
    EXPECT_EQ(file->report.zero_area_faces, 0u);
    EXPECT_EQ(file->report.duplicate_faces, room.name == "school" ? 16u : 0u);
    precompute::RoomSurvey survey;
    const auto done = precompute::survey_room(*file, 0, survey);
    ASSERT_TRUE(done) << done.error().message();
    EXPECT_EQ(survey.apertures.report.window_polygons, openings.at(room.name).first);
    EXPECT_EQ(survey.apertures.report.hole_polygons, openings.at(room.name).second);
    EXPECT_LT(survey.apertures.report.unexplained_escape, 1e-3);
    EXPECT_TRUE(survey.gaps.list.empty());
  }
}

TEST(RealRooms, points_stand_in_the_air_away_from_surfaces) {
  const RealRoom room = school_wing();
  const auto file = file_of(room);
  ASSERT_TRUE(file);
  const auto rays = RayScene::build(file->room);
  for (const Place& place : room.places) {
    const auto points = points_in(room, file->room, place);
    ASSERT_TRUE(points) << points.error().message();
    EXPECT_EQ(std::ssize(*points), place.points);
    for (const glm::dvec3& p : *points)
      EXPECT_GE(rays->distance(rays->to_local(p), 1.0f), 0.0999f);
  }
}

/// From points all over the lit part of a building.
std::size_t rooms_of(const RealRoom& room) {
  const auto file = file_of(room);
  Bounds inside;
  for (const Place& place : room.places)
    if (place.lit) {
      inside.include(place.air.low);
      inside.include(place.air.high);
    }
  std::vector<glm::dvec3> in_air = precompute::spread_points(file->room, file->room.bounds(), 8192, 0.2);
  std::erase_if(in_air, [&](const glm::dvec3& p) {
    return glm::any(glm::lessThan(p, inside.min)) || glm::any(glm::greaterThan(p, inside.max));
  });
  return precompute::points_by_room(file->room, file->room.bounds(), in_air)->size();
}

TEST(RealRooms, count_a_corridor_once_and_rooms_that_are_seen_from_one_by_themselves) {
  EXPECT_EQ(rooms_of(school_wing()), 7u);
  EXPECT_GE(rooms_of(home()), 5u) << "of seven: bedroom, bath and corridor may be one";
}

TEST(RealRooms, furniture_has_a_hundred_thousand_triangles) {
  EXPECT_GT(file_of(furnished_living_room())->room.triangles.size(), 100'000u);
}

} // namespace
} // namespace daylit::bench
