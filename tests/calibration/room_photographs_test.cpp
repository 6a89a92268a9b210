// Rooms from markers in photographs: simulated corners, and simulated pictures through the program.

#include <cmath>
#include <random>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <gtest/gtest.h>

#include "calibration/room_photographs.h"
#include "scene/config/config.h"
#include "scene/image/image_formats.h"
#include "scene/room/room_formats.h"
#include "simulate/board_picture.h"
#include "tests/calibration/calibrate_program.h"

namespace daylit::calibration {
namespace {

namespace fs = std::filesystem;

constexpr double kSide = 0.18, kMargin = 0.03;

/// A marker on a surface of the test room: middle, and the print's right and up.
struct Print {
  int id;
  const char* on;
  glm::dvec3 middle, right, up;
};

LensModel camera() {
  LensModel lens = ideal_pinhole(1280, 960, 1.15);
  lens.distortion = {-0.1, 0.03};
  return lens;
}

/// 4.2 x 3.1 x 2.5 m; a window of 1.4 x 1.2 m on x0, whose lower left corner seen from inside is (0, 1.0, 0.9).
std::vector<Print> box() {
  const double h = 0.5 * kSide + kMargin; // the paper's corner touches the window's
  return {{1, "floor", {1.5, 1.2, 0}, {0.8, 0.6, 0}, {-0.6, 0.8, 0}},
          {2, "floor", {2.8, 2.0, 0}, {0, 1, 0}, {-1, 0, 0}},
          {3, "x0", {0, 1.0 - h, 0.9 - h}, {0, 1, 0}, {0, 0, 1}},
          {4, "x0", {0, 2.4 + h, 2.1 + h}, {0, 1, 0}, {0, 0, 1}},
          {5, "y1", {1.0, 3.1, 1.1}, {1, 0, 0}, {0, 0, 1}},
          {6, "y1", {3.2, 3.1, 1.4}, {0, 0, -1}, {1, 0, 0}},
          {7, "x1", {4.2, 1.5, 1.2}, {0, -1, 0}, {0, 0, 1}},
          {8, "y0", {2.0, 0, 1.3}, {-1, 0, 0}, {0, 0, 1}},
          {9, "ceiling", {2.0, 1.5, 2.5}, {1, 0, 0}, {0, -1, 0}}};
}

/// 5 x 4 x 2.5 m, of which 2 x 1.5 m are missing at largest x and y.
std::vector<Print> angle() {
  return {
      {1, "floor", {1.5, 1.2, 0}, {1, 0, 0}, {0, 1, 0}},         {2, "x0", {0, 2.0, 1.2}, {0, 1, 0}, {0, 0, 1}},
      {3, "y1", {1.5, 4.0, 1.3}, {1, 0, 0}, {0, 0, 1}},          {4, "cut_x", {3.0, 3.2, 1.2}, {0, -1, 0}, {0, 0, 1}},
      {5, "cut_y", {4.0, 2.5, 1.2}, {1, 0, 0}, {0, 0, 1}},       {6, "x1", {5.0, 1.2, 1.1}, {0, -1, 0}, {0, 0, 1}},
      {7, "y0", {2.5, 0, 1.2}, {-1, 0, 0}, {0, 0, 1}},           {8, "ceiling", {2.5, 1.2, 2.5}, {1, 0, 0}, {0, -1, 0}},
      {9, "floor", {3.5, 1.5, 0}, {0.6, 0.8, 0}, {-0.8, 0.6, 0}}};
}

const std::vector<std::array<glm::dvec3, 2>> kBoxViews = {{{{3.9, 0.3, 1.6}, {0.6, 2.2, 0.9}}},
                                                          {{{0.3, 2.8, 1.6}, {3.4, 0.6, 0.9}}},
                                                          {{{0.3, 0.3, 1.5}, {3.2, 2.9, 1.0}}},
                                                          {{{3.8, 2.8, 1.4}, {1.0, 0.6, 1.4}}},
                                                          {{{0.4, 0.4, 1.1}, {2.6, 1.9, 1.9}}}};
const std::vector<std::array<glm::dvec3, 2>> kAngleViews = {{{{4.6, 0.4, 1.6}, {0.8, 2.4, 0.8}}},
                                                            {{{0.4, 3.6, 1.6}, {3.2, 0.9, 0.9}}},
                                                            {{{0.4, 0.4, 1.5}, {4.4, 2.0, 1.0}}},
                                                            {{{1.0, 1.2, 1.4}, {3.0, 3.0, 1.2}}},
                                                            {{{0.5, 0.5, 1.2}, {2.4, 1.5, 1.9}}}};

glm::dmat4 room_from_print(const Print& p) {
  return {glm::dvec4(p.right, 0), glm::dvec4(p.up, 0), glm::dvec4(glm::cross(p.right, p.up), 0),
          glm::dvec4(p.middle, 1)};
}

/// Corners with noise of every print that is in the picture from the front, and not too much from the side.
std::vector<RoomPhotograph> corners_seen(const std::vector<Print>& prints,
                                         const std::vector<std::array<glm::dvec3, 2>>& views, double noise_px,
                                         unsigned seed = 5) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0.0, noise_px);
  std::vector<RoomPhotograph> all;
  for (const auto& [eye, target] : views) {
    const glm::dmat4 camera_from_room = glm::inverse(look_at(eye, target));
    RoomPhotograph photograph{fmt::format("{}.png", all.size()), {}};
    for (const Print& p : prints) {
      SeenMarker seen{p.id, {}};
      const glm::dvec3 way = eye - p.middle;
      bool visible = glm::dot(glm::cross(p.right, p.up), glm::normalize(way)) > 0.25;
      const auto corners = board_corners({p.id, kSide, glm::dvec2(0.0)});
      for (std::size_t k = 0; k < 4; ++k) {
        const glm::dvec3 at = p.middle + corners[k].x * p.right + corners[k].y * p.up;
        const auto px = camera().project(glm::dvec3(camera_from_room * glm::dvec4(at, 1)));
        visible = visible && px && px->x > 5 && px->y > 5 && px->x < 1274 && px->y < 954;
        if (visible)
          seen.corner_px[k] = *px + glm::dvec2(noise(random), noise(random));
      }
      if (visible)
        photograph.seen.push_back(seen);
    }
    all.push_back(photograph);
  }
  return all;
}

RoomMarkers markers_of(const std::vector<Print>& prints) {
  RoomMarkers m;
  m.side_m = kSide;
  m.margin_m = kMargin;
  for (const Print& p : prints)
    m.on[p.id] = p.on;
  return m;
}

TEST(RoomFromMarkers, a_box_and_an_angle_are_found_without_noise_exactly) {
  const auto box_found = measure_room(markers_of(box()), camera(), corners_seen(box(), kBoxViews, 0.0));
  ASSERT_TRUE(box_found) << box_found.error().message();
  EXPECT_LT(box_found->rms_px, 1e-4);
  EXPECT_NEAR(box_found->place_m.at("x1"), 4.2, 1e-5);
  EXPECT_NEAR(box_found->place_m.at("y1"), 3.1, 1e-5);
  EXPECT_NEAR(box_found->place_m.at("ceiling"), 2.5, 1e-5);
  const auto found = measure_room(markers_of(angle()), camera(), corners_seen(angle(), kAngleViews, 0.0));
  ASSERT_TRUE(found) << found.error().message();
  for (const auto& [name, place] :
       {std::pair{"x1", 5.0}, {"y1", 4.0}, {"cut_x", 3.0}, {"cut_y", 2.5}, {"ceiling", 2.5}})
    EXPECT_NEAR(found->place_m.at(name), place, 1e-5) << name;
}

TEST(RoomFromMarkers, noise_moves_the_walls_as_far_as_is_stated) {
  double squares = 0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const auto found = measure_room(markers_of(box()), camera(), corners_seen(box(), kBoxViews, 0.3, seed));
    ASSERT_TRUE(found) << found.error().message();
    for (const auto& [name, place] : {std::pair{"x1", 4.2}, {"y1", 3.1}, {"ceiling", 2.5}}) {
      squares += std::pow((found->place_m.at(name) - place) / found->sigma_m.at(name), 2) / 60;
      EXPECT_LT(found->sigma_m.at(name), 0.04) << name;
    }
  }
  EXPECT_GT(squares, 0.55); // chi squared of 60: 99.9 % within 0.5 and 1.65
  EXPECT_LT(squares, 1.65);
}

TEST(RoomFromMarkers, what_is_missing_is_named) {
  auto prints = box();
  std::erase_if(prints, [](const Print& p) { return std::string(p.on) == "x1"; });
  const auto no_wall = measure_room(markers_of(prints), camera(), corners_seen(prints, kBoxViews, 0.0));
  ASSERT_FALSE(no_wall);
  EXPECT_NE(no_wall.error().what.find("a marker on x1"), std::string::npos) << no_wall.error().what;
  auto photographs = corners_seen(box(), kBoxViews, 0.0);
  std::erase_if(photographs[0].seen, [](const SeenMarker& m) { return m.id > 2; });
  const auto floor_only = measure_room(markers_of(box()), camera(), photographs);
  ASSERT_TRUE(floor_only) << floor_only.error().message();
  ASSERT_EQ(floor_only->dropped.size(), 1u);
  EXPECT_EQ(floor_only->dropped[0].file, "0.png");
  EXPECT_NEAR(floor_only->place_m.at("x1"), 4.2, 1e-4);
  auto wrong = markers_of(box());
  wrong.on[5] = "x0"; // it is on y1
  const auto moved = measure_room(wrong, camera(), corners_seen(box(), kBoxViews, 0.0));
  ASSERT_TRUE(moved) << moved.error().message();
  EXPECT_GT(moved->rms_px, 1.0) << "no noise";
  ASSERT_FALSE(faults_of(*moved).empty());
  EXPECT_NE(faults_of(*moved)[0].find("it is on another one"), std::string::npos);
}

/// Each print by itself, the brightest of all: they do not cover each other.
void photograph(const fs::path& file, const std::vector<Print>& prints, const std::array<glm::dvec3, 2>& view) {
  const glm::dmat4 camera_from_room = glm::inverse(look_at(view[0], view[1]));
  const BoardCamera sensor(camera(), {.blur_px = 0.7, .noise = {0.003, 2e-5, 0.0}, .uneven = 0.0});
  Rgb8Image all;
  for (const Print& p : prints) {
    if (glm::dot(glm::cross(p.right, p.up), view[0] - p.middle) < 0.1)
      continue;
    auto board = PrintedBoard::print(BoardLayout::single("6X6_250", p.id, kSide), kMargin);
    ASSERT_TRUE(board);
    const Rgb8Image one =
        sensor.picture(*board, camera_from_room * room_from_print(p), static_cast<std::uint32_t>(p.id));
    if (all.bytes.empty())
      all = one;
    for (std::size_t i = 0; i < one.bytes.size(); ++i) // far from the wall's grey: the print
      if (std::abs(one.bytes[i] - 124) > std::abs(all.bytes[i] - 124))
        all.bytes[i] = one.bytes[i];
  }
  ASSERT_TRUE(write_png(file, all));
}

TEST(RoomProgram, photographs_of_markers_become_a_room_with_its_window) {
  const fs::path folder = test::fresh_folder("room-photographs");
  ASSERT_TRUE(write_lens(folder / "camera.yaml", camera()));
  std::ofstream plan(folder / "room.toml");
  plan << fmt::format("[photographs]\nlens = \"camera.yaml\"\nside = {}\nmargin = {}\n", kSide, kMargin);
  for (std::size_t k = 0; k < kBoxViews.size(); ++k) {
    photograph(folder / fmt::format("{}.png", k), box(), kBoxViews[k]);
    plan << fmt::format("[[photograph]]\nimage = \"{}.png\"\n", k);
  }
  for (const Print& p : box())
    plan << fmt::format("[[marker]]\nid = {}\non = \"{}\"\n", p.id, p.on);
  plan << "[[window]]\nwall = \"x0\"\nmarkers = [3, 4]\n";
  plan.close();
  const auto done = test::calibrate(folder, "room room.toml -o room.obj --report r");
  ASSERT_EQ(done.exit_code, 0) << done.json;
  EXPECT_EQ(done.json["verdict"], "pass") << done.json["why"];
  EXPECT_LT(done.json["rms_px"], 0.4);
  const double size[] = {4.2, 3.1, 2.5};
  for (std::size_t k = 0; k < 3; ++k)
    EXPECT_NEAR(done.json["size_m"][k], size[k], 0.01) << k;
  EXPECT_NEAR(done.json["window_m2"], 1.4 * 1.2, 0.03);
  EXPECT_TRUE(read_room(folder / "room.obj"));
  EXPECT_EQ(done.json["used"].size(), 1 + kBoxViews.size());
}

} // namespace
} // namespace daylit::calibration
