// Corners in pictures that are drawn through a known lens.

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "tests/calibration/board_case.h"

namespace daylit::calibration {
namespace {

constexpr int kColumns = 8, kRows = 6;
constexpr double kSquare_m = 0.03;

/// Brightness of the board's plane: squares around the inner corners, a white margin, grey beyond.
double board_value(double x, double y) {
  const double u = x / kSquare_m + 1, v = y / kSquare_m + 1;
  if (u < -0.7 || v < -0.7 || u > kColumns + 1.7 || v > kRows + 1.7)
    return 0.35;
  if (u < 0 || v < 0 || u > kColumns + 1 || v > kRows + 1)
    return 0.9;
  return (static_cast<int>(u) + static_cast<int>(v)) % 2 == 0 ? 0.08 : 0.9;
}

/// Mean of 4 x 4 rays per pixel; black beyond the lens's field.
Rgb8Image picture_of(const LensModel& lens, const BoardPose& pose, double scale) {
  Rgb8Image image{lens.width_px, lens.height_px, {}};
  const glm::dvec3 x = pose.apply({1, 0, 0}) - pose.apply({0, 0, 0}), y = pose.apply({0, 1, 0}) - pose.apply({0, 0, 0}),
                   n = glm::cross(x, y), at = pose.apply({0, 0, 0});
  for (int row = 0; row < lens.height_px; ++row)
    for (int column = 0; column < lens.width_px; ++column) {
      double sum = 0;
      for (int k = 0; k < 16; ++k) {
        const auto d = lens.unproject({column + (k % 4 + 0.5) / 4 - 0.5, row + (k / 4 + 0.5) / 4 - 0.5});
        if (!d)
          continue;
        const double t = glm::dot(at, n) / glm::dot(*d, n);
        const glm::dvec3 p = t * *d - at;
        sum += t > 0 ? board_value(glm::dot(p, x), glm::dot(p, y)) : 0.35;
      }
      const auto value = static_cast<std::uint8_t>(std::lround(std::min(255.0 * scale * sum / 16, 255.0)));
      image.bytes.insert(image.bytes.end(), 3, value);
    }
  return image;
}

struct Case {
  std::vector<glm::dvec3> board = board_points(kColumns, kRows, kSquare_m);
  LensModel lens = test::true_fisheye();
  BoardPose pose = test::board_at(board, 0.6, 0.4, 0.24, 0.3, 0.5);
};

TEST(Checkerboard, corners_are_found_to_a_tenth_of_a_pixel) {
  const Case c;
  const auto found = find_checkerboard(picture_of(c.lens, c.pose, 1.0), {kColumns, kRows});
  ASSERT_TRUE(found);
  double worst = 0;
  for (const glm::dvec2& p : *found) {
    double nearest = 1e9;
    for (const glm::dvec3& b : c.board)
      nearest = std::min(nearest, glm::distance(p, *c.lens.project(c.pose.apply(b))));
    worst = std::max(worst, nearest);
  }
  EXPECT_LT(worst, 0.12);
}

TEST(Checkerboard, why_it_is_not_found_is_said) {
  const Case c;
  EXPECT_NE(why_not_found(picture_of(c.lens, c.pose, 1.0), {kColumns - 1, kRows - 1}).find("8 x 6"), std::string::npos);
  EXPECT_NE(
      why_not_found(Rgb8Image{640, 480, std::vector<std::uint8_t>(3 * 640 * 480, 3)}, {kColumns, kRows}).find("dark"),
      std::string::npos);
  EXPECT_NE(why_not_found(picture_of(c.lens, c.pose, 30.0), {kColumns, kRows}).find("over-exposed"), std::string::npos);
  Rgb8Image grey{640, 480, std::vector<std::uint8_t>(3 * 640 * 480, 120)};
  EXPECT_NE(why_not_found(grey, {kColumns, kRows}).find("blurred"), std::string::npos);
}

TEST(Checkerboard, circle_of_a_fisheye_is_found_and_none_where_there_is_none) {
  Case c;
  c.lens.max_theta = 90 * test::kDegree;
  CircleFinder finder;
  finder.add(picture_of(c.lens, c.pose, 1.0));
  const ImageCircle circle = finder.find();
  const double radius = c.lens.project({1, 0, 1e-9})->x - c.lens.cx;
  EXPECT_NEAR(circle.radius, radius, 0.01 * radius);
  EXPECT_NEAR(circle.centre.x, c.lens.cx, 2.0);
  EXPECT_NEAR(circle.centre.y, c.lens.cy, 2.0);
  CircleFinder none;
  none.add({640, 480, std::vector<std::uint8_t>(3 * 640 * 480, 120)});
  EXPECT_EQ(none.find().radius, 0.0);
}

TEST(Checkerboard, circle_is_found_where_noise_is_brighter_than_a_tenth_of_the_picture) {
  Case c;
  c.lens.max_theta = 90 * test::kDegree;
  Rgb8Image picture = picture_of(c.lens, c.pose, 1.0);
  std::mt19937 random(2);
  std::uniform_int_distribution<int> noise(0, 40);
  for (std::uint8_t& code : picture.bytes)
    code = static_cast<std::uint8_t>(std::min(255, code + noise(random)));
  CircleFinder finder;
  finder.add(picture);
  const double radius = c.lens.project({1, 0, 1e-9})->x - c.lens.cx;
  EXPECT_NEAR(finder.find().radius, radius, 0.01 * radius);
}

} // namespace
} // namespace daylit::calibration
