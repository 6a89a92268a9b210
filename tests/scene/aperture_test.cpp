#include "scene/room/aperture.h"
#include "scene/room/pane_outline.h"

#include <cmath>
#include <filesystem>
#include <limits>
#include <numbers>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "scene/room/dark_room.h"
#include "scene/room/room_formats.h"
#include "tests/scene/test_rooms.h"

namespace daylit {
namespace {

using test::room_with_hole;
using test::RoomBuilder;

Result<Apertures> find(const Room& room) {
  Result<RayScene> scene = RayScene::build(room);
  if (!scene)
    return scene.error();
  return find_apertures(room, *scene);
}

void expect_one(const Room& room, std::size_t corners, const glm::dvec3& inward, double area) {
  const Result<Apertures> found = find(room);
  ASSERT_TRUE(found) << found.error().message();
  ASSERT_EQ(found->list.size(), 1u);
  EXPECT_EQ(found->list[0].corners.size(), corners);
  EXPECT_LT(glm::distance(found->list[0].inward, inward), 1e-6);
  EXPECT_NEAR(found->report.hole_area_m2 + found->report.window_area_m2, area, 1e-6);
  EXPECT_EQ(found->report.unexplained_escape, 0.0);
}

TEST(Aperture, hole_between_t_junctions_is_one_quad_facing_in) { expect_one(room_with_hole().room, 4, {0, 1, 0}, 2.0); }

TEST(Aperture, hole_far_from_the_origin_is_found) {
  expect_one(room_with_hole({1e6, -2e6, 300}).room, 4, {0, 1, 0}, 2.0);
}

TEST(Aperture, missing_face_of_a_box_is_a_hole) {
  RoomBuilder b;
  b.box({0, 0, 0}, {1, 1, 1}, b.material("grey"), 63 & ~2u);
  expect_one(b.room, 4, {-1, 0, 0}, 1.0);
}

TEST(Aperture, box_without_bottom_on_the_floor_is_no_hole) {
  RoomBuilder b = room_with_hole();
  b.box({1, 2, 0}, {2, 3, 1}, 0, 63 & ~16u);
  b.box({3, 4, 0}, {4, 5, 1}, 0, 63 & ~16u);   // in a corner: two of its bottom edges lie on room edges
  b.box({1, 0, 0}, {2, 0.5, 1}, 0, 63 & ~16u); // under the hole: its top edge lies on the sill
  expect_one(b.room, 4, {0, 1, 0}, 2.0);
}

TEST(Aperture, sheet_in_the_room_is_no_hole) {
  RoomBuilder b = room_with_hole();
  b.quad({1, 2, 1}, {2, 2, 1}, {2, 3, 1}, {1, 3, 1}, 0);         // table top
  b.quad({0, 2.5, 0}, {2, 2.5, 0}, {2, 2.5, 3}, {0, 2.5, 3}, 0); // partition
  b.wall_with_hole(3.5, 0, 4, 0, 3, 1.5, 2.5, 0.5, 2.5, 0);      // inner wall with a door
  expect_one(b.room, 4, {0, 1, 0}, 2.0);
}

TEST(Aperture, pane_of_two_triangles_is_one_quad) {
  RoomBuilder b = room_with_hole();
  const auto glass = b.material("window", Rgb(0), Rgb(0.7f, 0.8f, 0.9f));
  b.quad({1, 0, 1}, {3, 0, 1}, {3, 0, 2}, {1, 0, 2}, glass);
  expect_one(b.room, 4, {0, 1, 0}, 2.0);
  const auto found = find(b.room);
  EXPECT_EQ(found->report.window_polygons, 1);
  EXPECT_EQ(found->report.hole_polygons, 0);
  EXPECT_EQ(found->list[0].transmittance, Rgb(0.7f, 0.8f, 0.9f));
}

TEST(Aperture, pane_set_back_in_the_opening_replaces_the_hole) {
  for (const double y : {-0.1, 0.1}) {
    RoomBuilder b = room_with_hole();
    b.quad({0.95, y, 0.95}, {3.05, y, 0.95}, {3.05, y, 2.05}, {0.95, y, 2.05}, b.material("window_1"));
    const auto found = find(b.room);
    ASSERT_TRUE(found) << found.error().message();
    EXPECT_EQ(found->report.window_polygons, 1) << y;
    EXPECT_EQ(found->report.hole_polygons, 0) << y;
  }
}

TEST(Aperture, grid_of_panes_becomes_one_polygon_per_material) {
  RoomBuilder b = room_with_hole();
  const auto left = b.material("window_left"), right = b.material("window_right");
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 2; ++j)
      b.quad({1 + 0.5 * i, 0, 1 + 0.5 * j}, {1.5 + 0.5 * i, 0, 1 + 0.5 * j}, {1.5 + 0.5 * i, 0, 1.5 + 0.5 * j},
             {1 + 0.5 * i, 0, 1.5 + 0.5 * j}, i < 2 ? left : right);
  const auto found = find(b.room);
  ASSERT_TRUE(found) << found.error().message();
  EXPECT_EQ(found->list.size(), 2u);
  for (const Aperture& a : found->list)
    EXPECT_EQ(a.corners.size(), 4u);
  EXPECT_NEAR(found->report.window_area_m2, 2.0, 1e-12);
}

TEST(Aperture, concave_hole_is_cut_in_convex_parts_of_equal_area) {
  // Wall y = 0 of the unit cube missing an L: only the square x > 1/2, z > 1/2 is there.
  RoomBuilder b;
  const auto grey = b.material("grey");
  b.box({0, 0, 0}, {1, 1, 1}, grey, 63 & ~4u);
  b.quad({0.5, 0, 0.5}, {1, 0, 0.5}, {1, 0, 1}, {0.5, 0, 1}, grey);
  const auto found = find(b.room);
  ASSERT_TRUE(found) << found.error().message();
  EXPECT_EQ(found->list.size(), 2u);
  EXPECT_NEAR(found->report.hole_area_m2, 0.75, 1e-9);
  EXPECT_EQ(found->report.unexplained_escape, 0.0);
}

TEST(Aperture, reveal_without_outer_skin_opens_at_its_outer_end) {
  RoomBuilder b = room_with_hole();
  b.box({1, -0.4, 1}, {3, 0, 2}, 0, 63 & ~12u);
  expect_one(b.room, 4, {0, 1, 0}, 2.0);
  EXPECT_DOUBLE_EQ(find(b.room)->list[0].corners[0].y, -0.4);
}

TEST(Aperture, opening_through_a_wall_with_thickness_is_found_at_its_rim) {
  // Closed surface: inner shell, outer shell, and the tunnel that joins them; no open edge anywhere.
  RoomBuilder b = room_with_hole();
  b.box({1, -0.4, 1}, {3, 0, 2}, 0, 63 & ~12u);
  b.box({-0.4, -0.4, -0.4}, {4.4, 5.4, 3.4}, 0, 63 & ~4u);
  b.wall_with_hole(-0.4, -0.4, 4.4, -0.4, 3.4, 1, 3, 1, 2, 0);
  expect_one(b.room, 4, {0, 1, 0}, 2.0);
}

TEST(Aperture, rim_of_an_outer_skin_that_stands_free_is_no_opening) {
  RoomBuilder b = room_with_hole();
  b.wall_with_hole(-0.3, 0, 4, 0, 3, 1, 3, 1, 2, 0);
  b.box({1, -0.3, 1}, {3, 0, 2}, 0, 63 & ~(4u | 8u));
  b.quad({0, -0.3, 2.9}, {4, -0.3, 2.9}, {4, -1.1, 3.1}, {0, -1.1, 3.1}, 0); // a canopy
  expect_one(b.room, 4, {0, 1, 0}, 2.0);
}

TEST(Aperture, round_hole_is_one_convex_polygon) {
  RoomBuilder b;
  const auto grey = b.material("grey");
  b.box({0, 0, 0}, {4, 4, 3}, grey, 63 & ~32u);
  const int n = 24;
  const double pi = std::numbers::pi;
  const auto ring = [&](int k, double r) {
    return glm::dvec3(2 + r * std::cos(2 * pi * k / n), 2 + r * std::sin(2 * pi * k / n), 3);
  };
  const auto edge = [&](int k) { // the same direction, on the border of the square ceiling
    const glm::dvec3 d = ring(k, 1.0) - glm::dvec3(2, 2, 3);
    return glm::dvec3(2, 2, 3) + d * (2.0 / std::max(std::abs(d.x), std::abs(d.y)));
  };
  for (int k = 0; k < n; ++k)
    b.quad(ring(k, 1), edge(k), edge((k + 1) % n), ring((k + 1) % n, 1), grey);
  expect_one(b.room, n, {0, 0, -1}, 0.5 * n * std::sin(2 * pi / n));
}

TEST(Aperture, closed_room_is_refused_with_advice) {
  RoomBuilder b;
  b.box({0, 0, 0}, {4, 5, 3}, b.material("grey"));
  const auto found = find(b.room);
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().code, ErrorCode::geometry_invalid);
  EXPECT_NE(found.error().message().find("window"), std::string::npos);
}

TEST(Aperture, pane_painted_on_a_wall_is_named_in_the_error) {
  RoomBuilder b;
  b.box({0, 0, 0}, {4, 5, 3}, b.material("grey"));
  b.quad({1, 0, 1}, {3, 0, 1}, {3, 0, 2}, {1, 0, 2}, b.material("window.front"));
  const auto found = find(b.room);
  ASSERT_FALSE(found);
  EXPECT_NE(found.error().message().find("window.front"), std::string::npos) << found.error().message();
}

TEST(Aperture, hole_that_is_not_flat_shows_as_unexplained_escape) {
  RoomBuilder b; // two neighbouring walls missing: the outline is folded; the ceiling is a pane
  b.box({0, 0, 0}, {1, 1, 1}, b.material("grey"), 63 & ~(2u | 8u | 32u));
  b.quad({0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}, b.material("window"));
  const auto found = find(b.room);
  ASSERT_TRUE(found) << found.error().message();
  EXPECT_EQ(found->report.window_polygons, 1);
  EXPECT_EQ(found->report.hole_polygons, 0);
  EXPECT_GT(found->report.unexplained_escape, 0.1);
  EXPECT_FALSE(found->report.notes.empty());
}

TEST(DarkRoom, is_closed_and_large_enough_to_stand_in) {
  RoomBuilder b = room_with_hole();
  b.box({0, 0, 3.2}, {4, 5, 5.2}, 0);          // an attic
  b.box({3, 2, 0}, {3.6, 4, 2.1}, 0);          // a wardrobe
  b.box({10, 0, 0}, {13, 3, 2.5}, 0, 63 - 32); // a yard
  const RayScene rays = *RayScene::build(b.room);
  const auto found = find_apertures(b.room, rays);
  ASSERT_TRUE(found) << found.error().message();
  const auto dark = [&](const glm::dvec3& p) { return is_in_dark_room(rays, b.room, found->list, p); };
  EXPECT_TRUE(dark({2, 2, 4}));
  EXPECT_TRUE(dark({0.05, 4.9, 3.3}));
  EXPECT_FALSE(dark({2, 2, 1.5})) << "the room with the hole";
  EXPECT_FALSE(dark({3.3, 3, 1})) << "in the wardrobe";
  EXPECT_FALSE(dark({11, 1, 1})) << "in the yard";
  EXPECT_FALSE(dark({-5, 0, 1})) << "outdoors";
}

TEST(Aperture, pane_drawn_twice_counts_once) {
  RoomBuilder b = room_with_hole();
  const std::uint32_t glass = b.material("WINDOW", Rgb(0.0f), Rgb(0.8f));
  const std::vector<glm::dvec3> c = {{1, 0, 1}, {3, 0, 1}, {3, 0, 2}, {1, 0, 2}};
  b.quad(c[0], c[1], c[2], c[3], glass);
  b.quad(c[1], c[2], c[3], c[0], glass); // the other diagonal: no exact duplicate
  const auto found = find_apertures(b.room, *RayScene::build(b.room));
  ASSERT_TRUE(found) << found.error().message();
  ASSERT_EQ(found->list.size(), 1u);
  ASSERT_EQ(found->report.notes.size(), 1u);
  EXPECT_NE(found->report.notes[0].find("drawn twice"), std::string::npos);
}

TEST(Aperture, light_from_the_house_across_the_street_is_no_escape) {
  RoomBuilder b = room_with_hole();
  b.quad({-20, -6, -5}, {20, -6, -5}, {20, -6, 10}, {-20, -6, 10}, 0);
  const auto found = find_apertures(b.room, *RayScene::build(b.room));
  ASSERT_TRUE(found) << found.error().message();
  EXPECT_EQ(found->report.unexplained_escape, 0.0);
}

/// A room of 4 x 5 x 3 m with a pane to a space of 4 x 4 m that is `high`, with a square hole in its roof.
Room room_on_a_court(double high, double hole) {
  RoomBuilder b = room_with_hole();
  b.quad({1, 0, 1}, {3, 0, 1}, {3, 0, 2}, {1, 0, 2}, b.material("window"));
  b.box({0, -4, 0}, {4, 0, 3}, 0, 1u | 2u | 4u | 16u);
  b.box({0, -4, 3}, {4, 0, high}, 0, 1u | 2u | 4u | 8u);
  const double from = 2 - 0.5 * hole, to = 2 + 0.5 * hole;
  for (const auto& [x0, x1, y0, y1] : {std::array{0.0, 4.0, -4.0, from - 4}, std::array{0.0, 4.0, to - 4, 0.0},
                                       std::array{0.0, from, from - 4, to - 4}, std::array{to, 4.0, from - 4, to - 4}})
    if (x1 > x0 && y1 > y0)
      b.quad({x0, y0, high}, {x1, y0, high}, {x1, y1, high}, {x0, y1, high}, 0);
  return b.room;
}

TEST(Aperture, a_pane_on_a_deep_court_lets_light_in_from_there) {
  for (int high = 6; high <= 18; ++high) {
    const auto found = find(room_on_a_court(high, 4.0));
    ASSERT_TRUE(found);
    ASSERT_EQ(found->report.window_polygons, 1) << high;
    EXPECT_GT(found->list[0].inward.y, 0.0) << high;
    for (const std::string& note : found->report.notes)
      EXPECT_EQ(note.find("sees no sky"), std::string::npos) << high << ": " << note;
    EXPECT_EQ(found->report.unexplained_escape, 0.0) << high;
  }
}

TEST(Aperture, a_pane_that_hardly_sees_a_surface_has_no_room) {
  RoomBuilder b = room_with_hole();
  b.quad({11, 11, 11}, {12, 11, 11}, {12, 12, 12}, {11, 12, 12}, b.material("window"));
  const auto found = find(b.room);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->report.window_polygons, 0);
  ASSERT_EQ(found->report.notes.size(), 1u);
  EXPECT_NE(found->report.notes[0].find("no room on either side"), std::string::npos) << found->report.notes[0];
}

TEST(Aperture, a_courtyard_is_outdoors_and_a_room_with_an_open_skylight_is_not) {
  const auto court = find(room_on_a_court(8.0, 4.0)), skylight = find(room_on_a_court(3.5, 1.5));
  ASSERT_TRUE(court && skylight);
  EXPECT_EQ(court->report.window_polygons, 1);
  EXPECT_EQ(court->report.hole_polygons, 0);
  EXPECT_NEAR(court->list[0].inward.y, 1.0, 1e-12);
  ASSERT_EQ(court->report.notes.size(), 1u);
  EXPECT_NE(court->report.notes[0].find("courtyard"), std::string::npos);
  EXPECT_EQ(skylight->report.window_polygons, 1);
  EXPECT_EQ(skylight->report.hole_polygons, 1);
}

TEST(Aperture, transmittances_multiply_along_a_segment) {
  const glm::dvec3 n(0, 1, 0);
  const auto pane = [&](double y, float t) {
    return Aperture{{{0, y, 0}, {1, y, 0}, {1, y, 1}, {0, y, 1}}, n, Rgb(t)};
  };
  const std::vector<Aperture> panes{pane(0.0, 0.5f), pane(-0.1, 0.4f)};
  int crossed = -1;
  EXPECT_FLOAT_EQ(
      aperture_transmittance(panes, {0.5, 1, 0.5}, {0, -1, 0}, std::numeric_limits<double>::infinity(), &crossed).r,
      0.2f);
  EXPECT_EQ(crossed, 2);
  EXPECT_FLOAT_EQ(aperture_transmittance(panes, {0.5, 1, 0.5}, {0, -1, 0}, 1.05, &crossed).r, 0.5f);
  EXPECT_EQ(crossed, 1);
  EXPECT_FLOAT_EQ(aperture_transmittance(panes, {1.5, 1, 0.5}, {0, -1, 0}, 9.0, &crossed).r, 1.0f);
  EXPECT_EQ(crossed, 0);
  EXPECT_FLOAT_EQ(aperture_transmittance(panes, {0.5, 1, 0.5}, {0, 1, 0}, 9.0).r, 1.0f);
}

TEST(Aperture, reference_rooms_have_the_openings_they_state) {
  const std::filesystem::path folder = DAYLIT_SOURCE_DIR "/../shared/truth/scenes";
  if (!std::filesystem::exists(folder))
    GTEST_SKIP() << "reference scenes not present";
  for (const auto& [name, area] : {std::pair{"s1_daylit_cornell.obj", 1.6 * 1.2}, std::pair{"s3_furnace.obj", 0.0}}) {
    const auto file = read_room(folder / name);
    ASSERT_TRUE(file) << file.error().message();
    const auto found = find(file->room);
    ASSERT_TRUE(found) << found.error().message();
    ASSERT_EQ(found->list.size(), 1u) << name;
    EXPECT_EQ(found->list[0].corners.size(), 4u) << name;
    EXPECT_EQ(found->report.unexplained_escape, 0.0) << name;
    if (area > 0.0) {
      EXPECT_NEAR(found->report.hole_area_m2, area, 1e-9);
      EXPECT_EQ(found->list[0].inward, glm::dvec3(0, 1, 0));
    }
  }
}

TEST(Aperture, crossings_of_many_rays_are_those_of_single_ones) {
  std::vector<Aperture> panes;
  for (int k = 0; k < 5; ++k) {
    const double x = 1.2 * k;
    panes.push_back({{{x, 0.1 * k, 0}, {x + 1, 0.1 * k, 0}, {x + 1, 0.1 * k, 1}, {x, 0.1 * k, 1}},
                     {0, k % 2 == 0 ? 1.0 : -1.0, 0},
                     Rgb(0.5f + 0.1f * static_cast<float>(k)),
                     k == 3 ? 1.52f : 0.0f});
  }
  const ApertureCrossings crossings(panes);
  int crossed = 0;
  for (int i = 0; i < 4000; ++i) {
    const auto part = [i](double step) { return std::fmod(step * (i + 1), 1.0); };
    const glm::dvec3 p(7 * part(0.618) - 0.5, 3 * part(0.414) - 1.5, part(0.732));
    const glm::dvec3 d = glm::normalize(glm::dvec3(part(0.236) - 0.5, part(0.317) - 0.5, 0.3 * part(0.123) - 0.15));
    const double distance = i % 2 == 0 ? std::numeric_limits<double>::infinity() : part(0.555);
    int count = 0;
    const Rgb through = aperture_transmittance(panes, p, d, distance, &count);
    const ApertureCrossings::Met met = crossings.met(p, d, distance);
    EXPECT_EQ(met.count, count);
    EXPECT_EQ(met.transmittance, through);
    EXPECT_EQ(met.nearest_m<distance, count> 0);
    crossed += count;
  }
  EXPECT_GT(crossed, 500);
}

TEST(PaneOutline, width_is_the_shorter_side_and_distance_that_to_the_outline) {
  const Aperture leaning{{{1, 0, 0}, {4, 0, 0}, {4, 0.6, 0.8}, {1, 0.6, 0.8}}, {0, -0.8, 0.6}, Rgb(1.0f), 0.0f};
  const PaneOutline pane(leaning, {1, 0, 0});
  EXPECT_NEAR(pane.width_m, 1.0, 1e-12);
  EXPECT_NEAR(pane.distance({1.5, -0.3, 0}), 0.3, 1e-12);
  EXPECT_NEAR(pane.distance({1.5, 0.3, 0.4}), 0.5, 1e-12) << "in its middle";
  EXPECT_NEAR(pane.distance({-3, 0, -4}), 5.0, 1e-12);
}

} // namespace
} // namespace daylit
