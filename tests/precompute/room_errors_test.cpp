// Errors room by room: where they are measured, and what is told of them.

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "precompute/planned_bake.h"
#include "precompute/room_points.h"
#include "scene/room/ray_scene.h"
#include "tests/scene/test_rooms.h"
#include "tests/scene/test_volumes.h"

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
    EXPECT_EQ(r.points.size(), 120u);
    int close = 0;
    for (const glm::dvec3& p : r.points) {
      const auto off = static_cast<double>(rays->distance(rays->to_local(p), 5.0f));
      EXPECT_GE(off, 0.1);
      close += off < 0.2 ? 1 : 0;
      EXPECT_TRUE(p.x > r.box.min.x && p.y > r.box.min.y && p.z > r.box.min.z && p.x < r.box.max.x &&
                  p.y < r.box.max.y && p.z < r.box.max.z);
      EXPECT_FALSE(p.x > 1 && p.x < 3 && p.y > 1 && p.y < 2 && p.z < 0.7) << "in the table";
    }
    EXPECT_EQ(close, 40);
  }
}

TEST(PointsByRoom, weigh_by_the_air_that_they_stand_for) {
  const Room room = two_rooms({0, 0, 0});
  const auto rooms = points_by_room(room, room.bounds(), {{2, 3.5, 1.2}, {3.5, 0.5, 1}, {1, 3, 2.5}});
  ASSERT_TRUE(rooms) << rooms.error().message();
  const RoomPoints& found = rooms->front();
  const Result<RayScene> rays = RayScene::build(room);
  const auto off = [&](const glm::dvec3& p) { return static_cast<double>(rays->distance(rays->to_local(p), 5.0f)); };
  ASSERT_EQ(found.weight.size(), found.points.size());
  double close = 0, all = 0;
  for (std::size_t p = 0; p < found.points.size(); ++p) {
    close += off(found.points[p]) < 0.2 ? found.weight[p] : 0.0;
    all += found.weight[p];
  }
  double close_air = 0, air = 0; // of a plain grid in the same room, 0.1 m from surfaces on, not in the table
  for (double x = 0.025; x < 4; x += 0.05)
    for (double y = 0.025; y < 4; y += 0.05)
      for (double z = 0.025; z < 3; z += 0.05) {
        const double d = off({x, y, z});
        const bool in_table = x > 1 && x < 3 && y > 1 && y < 2 && z < 0.7;
        air += d >= 0.1 && !in_table ? 1 : 0;
        close_air += d >= 0.1 && d < 0.2 && !in_table ? 1 : 0;
      }
  EXPECT_NEAR(close / all, close_air / air, 0.03);
}

TEST(PointsByRoom, a_room_counts_once_though_its_box_is_another_from_a_reveal_and_another_room_does_not_join_it) {
  test::RoomBuilder b;
  const auto wall = b.material("wall");
  b.box({0, 0, 0}, {4, 4, 3}, wall, 63 & ~4u);
  b.wall_with_hole(0.0, 0, 4, 0, 3, 1, 3, 1, 2, wall);
  b.box({1, -0.6, 1}, {3, 0, 2}, wall, 63 & ~(4u | 8u)); // the reveal: open to the sky
  const auto one = points_by_room(b.room, b.room.bounds(), {{2, 2, 1.5}, {3, 1, 1}, {2, -0.2, 1.5}, {1.5, -0.1, 1.5}});
  ASSERT_TRUE(one) << one.error().message();
  ASSERT_EQ(one->size(), 1u);
  EXPECT_LT((*one)[0].box.min.y, -0.19);
  EXPECT_NEAR((*one)[0].box.max.y, 4.0, 0.02);
  const Room two = two_rooms({0, 0, 0});
  const auto both = points_by_room(two, two.bounds(), {{2, 2.5, 1.2}, {2, 5, 1}, {0.6, 3.9, 1}, {0.6, 4.1, 1}});
  ASSERT_TRUE(both) << both.error().message();
  EXPECT_EQ(both->size(), 2u);
}

TEST(PointsByRoom, a_hall_in_which_tall_furniture_stands_is_one_room) {
  test::RoomBuilder b;
  const auto wall = b.material("wall");
  b.box({0, 0, 0}, {36, 24, 6}, wall, 63 & ~1u);
  for (int k = 0; k < 20; ++k) {
    const glm::dvec3 at(1.0 + 34.0 * std::fmod(0.5 + 0.618 * k, 1.0), 1.0 + 21.0 * std::fmod(0.5 + 0.755 * k, 1.0), 0);
    b.box(at, at + glm::dvec3(0.8, 2.2, 3.4), wall);
  }
  std::vector<glm::dvec3> in_air;
  for (int k = 0; k < 400; ++k)
    in_air.emplace_back(36.0 * std::fmod(0.5 + 0.819 * k, 1.0), 24.0 * std::fmod(0.5 + 0.671 * k, 1.0),
                        6.0 * std::fmod(0.5 + 0.55 * k, 1.0));
  const auto rooms = points_by_room(b.room, b.room.bounds(), in_air);
  ASSERT_TRUE(rooms) << rooms.error().message();
  EXPECT_EQ(rooms->size(), 1u);
}

TEST(PointsByRoom, a_passage_is_one_room_though_no_place_in_it_sees_both_ends) {
  test::RoomBuilder b;
  const auto wall = b.material("wall");
  b.box({0, 0, 0}, {40, 2.5, 3}, wall, 63 & ~1u);
  b.box({0, 2.5, 0}, {6, 6, 3}, wall, 63 & ~4u); // a room beside it
  std::vector<glm::dvec3> in_air{{3, 4, 1.5}};
  for (double x = 1; x < 40; x += 2)
    in_air.emplace_back(x, 1.2, 1.5);
  const auto rooms = points_by_room(b.room, b.room.bounds(), in_air);
  ASSERT_TRUE(rooms) << rooms.error().message();
  ASSERT_EQ(rooms->size(), 2u);
  EXPECT_NEAR((*rooms)[0].box.min.x, 0.0, 1.0);
  EXPECT_NEAR((*rooms)[0].box.max.x, 40.0, 1.0);
  EXPECT_NEAR((*rooms)[0].box.max.y, 2.5, 0.02);
}

TEST(PointsByRoom, what_is_seen_from_a_doorway_is_no_room_of_its_own) {
  test::RoomBuilder b;
  const auto wall = b.material("wall");
  b.box({0, 0, 0}, {8, 8, 3}, wall, 63 & ~(4u | 8u));
  b.box({3.5, 8, 0}, {4.5, 8.3, 2}, wall, 63 & ~(4u | 8u)); // the doorway
  b.box({0, 8.3, 0}, {8, 16.3, 3}, wall, 63 & ~4u);
  b.wall_with_hole(0.0, 0, 8, 0, 3, 1, 3, 1, 2, wall);
  b.wall_with_hole(8.0, 0, 8, 0, 3, 3.5, 4.5, 0, 2, wall);
  b.wall_with_hole(8.3, 0, 8, 0, 3, 3.5, 4.5, 0, 2, wall);
  const auto rooms =
      points_by_room(b.room, b.room.bounds(), {{6, 4, 1}, {6, 12, 1}, {4, 8.15, 1.2}, {2, 3, 1.5}, {1, 13, 1}});
  ASSERT_TRUE(rooms) << rooms.error().message();
  ASSERT_EQ(rooms->size(), 2u);
  for (const RoomPoints& r : *rooms)
    EXPECT_LT(r.box.size().y, 9.0);
}

/// Two patches of 1 m2: the first is lit from all of the lowest band of suns, the second from one region of it.
struct TwoPatches {
  std::vector<radiosity::FirstBounceRow> rows{2};
  double east = 0; ///< azimuth of that region
  TwoPatches() {
    const SkyPartition& sky = held_out_partition();
    bool second = false;
    for (int r = 0; r < sky.size(); ++r)
      if (std::abs(std::asin(sky.centre(r).z) - 9.4 * std::numbers::pi / 180) < 0.001) {
        add(0, r);
        if (!second && sky.centre(r).x > 0.9) {
          add(1, r);
          east = std::atan2(sky.centre(r).y, sky.centre(r).x);
          second = true;
        }
      }
  }
  void add(std::size_t patch, int region) {
    rows[patch].region.push_back(region);
    rows[patch].irradiance.emplace_back(1.0f);
  }
};

glm::dvec3 direction_of(const HeldOutSky& sun) {
  return held_out_partition().centre(static_cast<int>(std::ranges::max_element(sun.radiance) - sun.radiance.begin()));
}

TEST(Suns, stand_where_their_light_counts_and_nowhere_twice) {
  const TwoPatches patches;
  EXPECT_EQ(suns(patches.rows, std::vector<double>{1, 0}, 3).size(), 3u);
  EXPECT_EQ(suns(patches.rows, std::vector<double>{1, 0}, 5).size(), 5u);
  const auto second = suns(patches.rows, std::vector<double>{0, 1}, 3);
  ASSERT_EQ(second.size(), 1u);
  EXPECT_NEAR(std::atan2(direction_of(second[0]).y, direction_of(second[0]).x), patches.east, 1e-9);
}

/// One point of a room, where objects stand too, whose volume has light of the lowest region alone: what is missing of
/// a sun counts beside the sky around it, of 1/7 of its irradiance on a plane that faces it.
TEST(RoomErrors,
     of_a_sun_are_relative_to_its_light_and_that_of_the_sky_around_it_and_so_are_those_where_objects_stand) {
  constexpr float kSun = 2.0f;
  const TwoPatches patches;
  BasisVolume volume = test::grid_volume(test::closed_room(), {2, 2, 2}, 1);
  const glm::dvec3 point = volume.room.bounds().centre();
  const RoomPoints one{volume.room.bounds(), {point}, {1.0}};
  auto audit = Audit::prepare(volume.room, {}, volume.probes, {point}, {point}, {one});
  ASSERT_TRUE(audit) << audit.error().message();
  radiosity::PatchSet set{std::vector<radiosity::Patch>(2), {}};
  set.patches[0].area_m2 = set.patches[0].importance = 1;
  set.patches[1].importance = 0;
  const std::vector<std::vector<double>> in_room{{0.0, 1.0}};
  const std::size_t skies = audit->direct_light(patches.rows, set, in_room).columns();
  const double sun_sr = held_out_partition().solid_angle_sr(patches.rows[1].region[0]);
  const auto sky = static_cast<float>(3 * static_cast<double>(kSun) * 7 * std::numbers::pi / sun_sr);
  volume.basis.assign(volume.basis.size(), 0.0f);
  for (std::size_t i = 0; i < volume.basis.size(); i += 27)
    std::fill_n(volume.basis.begin() + static_cast<std::ptrdiff_t>(i), 3, sky);
  std::vector<float> points(3 * 27 * skies, 0.0f), band4(points.size(), 0.0f), axes(points.size(), 0.0f);
  for (std::size_t p = 0; p < 3; ++p)
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t s = 0; s < skies; ++s) {
        const float coefficient = points[(p * 27 + c) * skies + s] = s == 0 ? sky : kSun;
        for (std::size_t axis = 0; axis < 6; ++axis)
          axes[(p * 27 + axis * 3 + c) * skies + s] = 0.5f * std::sqrt(std::numbers::pi_v<float>) * coefficient;
      }
  const std::vector<std::size_t> probes = audit->probes();
  const std::vector<float> at_probes(probes.size() * 27 * skies, 0.0f);
  AuditReport report = audit->judge(volume, {points, band4, axes, at_probes, probes});
  ASSERT_TRUE(report.sky.back().of_room);
  EXPECT_NEAR(report.sky.back().rooms[0].error, 0.25, 0.001) << "of 1 + 3 parts";
  EXPECT_NEAR(report.sky[0].rooms[0].error, 0.0, 0.001);
  EXPECT_EQ(report.sky.back().total, 0.0) << "counts in its room alone";
  const auto for_all = std::ranges::find_if(report.sky, [](const SkyError& e) { return e.is_sun && !e.of_room; });
  ASSERT_NE(for_all, report.sky.end());
  EXPECT_NEAR(for_all->standing, 0.25, 0.001);
  EXPECT_NEAR(for_all->total, 1.0, 0.001) << "in the air the sun's light is alone";
  for (std::size_t s = 0; s < skies; ++s)
    axes[(27 + 12) * skies + s] *= 1.5f; // red light on +z that no coefficient has
  report = audit->judge(volume, {points, band4, axes, at_probes, probes});
  EXPECT_NEAR(report.sky[0].standing, 0.5 / std::sqrt(17 + 1.5 * 1.5), 0.001) << "what the coefficients leave out";
  EXPECT_NEAR(report.sky[0].total, 0.0, 1e-6);
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

TEST(Measured, is_warned_of_where_it_is_above_what_was_asked_for_and_under_suns_above_twice_that) {
  Plan plan;
  plan.max_error = 0.02;
  const auto told = [&](double total, double sun) {
    Measured m;
    m.total = total;
    m.sun = sun;
    EXPECT_TRUE(to_text(plan, m).ends_with(missed_text(plan, m)));
    return missed_text(plan, m);
  };
  EXPECT_EQ(told(0.02, 0.04), "");
  EXPECT_NE(told(0.04, 0.03).find("--max-error 1 may reach"), std::string::npos);
  EXPECT_EQ(told(0.01, 0.05).find("note       under small suns"), 0u);
}

TEST(Measured, is_judged_by_the_room_that_misses_most) {
  Plan plan;
  plan.max_error = 0.02;
  Measured m;
  m.total = m.sun = 0.09; // of coefficients, over all points
  for (const auto& [x, smooth, sun] : {std::array{1.0, 0.019, 0.039}, std::array{5.0, 0.01, 0.02}}) {
    Measured::OfRoom& room = m.rooms.emplace_back();
    room.box = {glm::dvec3(x - 1, 0, 0), glm::dvec3(x + 1, 2, 2)};
    room.errors.smooth.percentile95 = smooth;
    room.errors.sun.percentile95 = sun;
  }
  EXPECT_EQ(missed_text(plan, m), "");
  EXPECT_TRUE(all_met(plan, m));
  EXPECT_FALSE(all_met(plan, Measured{}));
  m.rooms[1].errors.smooth.percentile95 = 0.08;
  EXPECT_FALSE(all_met(plan, m));
  m.rooms[0].errors.sun.percentile95 = 0.05;
  const std::string text = missed_text(plan, m);
  EXPECT_NE(text.find("in the room around 5.00,1.00,1.00 is 8 %"), std::string::npos) << text;
  EXPECT_NE(text.find("--max-error 0.5 may reach"), std::string::npos) << text;
  EXPECT_NE(text.find("under small suns the error in the room around 1.00,1.00,1.00 is 5 %"), std::string::npos)
      << text;
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
    EXPECT_GE(room.errors.sun.skies, 6u) << "suns of its own: the windows look to opposite sides";
    EXPECT_GE(room.points, 52u);
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
