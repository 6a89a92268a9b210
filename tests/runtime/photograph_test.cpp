#include "runtime/input/photograph.h"

#include "runtime/input/interior_input.h"

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <random>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "capture/markers/find_markers.h"

namespace daylit {
namespace {

class PhotographFile : public testing::Test {
protected:
  void SetUp() override {
    std::string pattern = (std::filesystem::temp_directory_path() / "daylit-photo-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::filesystem::path folder_;
};

TEST_F(PhotographFile, untouched_pixels_keep_their_bytes) {
  Rgb8Image image{40, 30, std::vector<std::uint8_t>(3 * 40 * 30)};
  std::mt19937 random(8);
  for (auto& b : image.bytes)
    b = static_cast<std::uint8_t>(random());
  image.bytes[0] = image.bytes[4] = 255;
  ASSERT_TRUE(write_png(folder_ / "a.png", image));
  const auto photo = read_photograph(folder_ / "a.png", "srgb");
  ASSERT_TRUE(photo) << photo.error().message();
  EXPECT_TRUE(photo->is_saturated(0) && photo->is_saturated(1));
  EXPECT_TRUE(photo->linear.empty()) << "an 8-bit photograph is kept in its own bytes";
  const RgbImage linear = photo->pixels().copy();
  EXPECT_EQ(linear.texels[7], Rgb(srgb_decode(float(image.bytes[21]) / 255), srgb_decode(float(image.bytes[22]) / 255),
                                  srgb_decode(float(image.bytes[23]) / 255)));
  RgbImage changed = linear;
  std::vector<std::uint8_t> touched(changed.texels.size());
  for (std::size_t i = 0; i < touched.size(); ++i) {
    changed.texels[i] *= 0.5f; // must not matter where touched is 0
    touched[i] = i % 3 == 0;
  }
  const auto out = encode_photograph(*photo, changed, touched);
  ASSERT_TRUE(out);
  for (std::size_t i = 0; i < touched.size(); ++i)
    for (std::size_t c = 0; c < 3; ++c) {
      const std::uint8_t before = image.bytes[3 * i + c], after = out->bytes[3 * i + c];
      if (!touched[i]) {
        ASSERT_EQ(after, before);
      } else {
        ASSERT_NEAR(srgb_decode(float(after) / 255), 0.5f * srgb_decode(float(before) / 255), 0.005f);
      }
    }
  // A touched pixel whose value did not change keeps its code too.
  EXPECT_EQ(encode_photograph(*photo, linear, std::vector<std::uint8_t>(touched.size(), 1))->bytes, image.bytes);
  EXPECT_FALSE(encode_photograph(*photo, RgbImage(3, 3), touched));
}

TEST_F(PhotographFile, exr_is_taken_as_it_is) {
  RgbImage image(8, 6, Rgb(0.25f, 4.0f, 1e5f));
  ASSERT_TRUE(write_exr(folder_ / "a.exr", image));
  const auto photo = read_photograph(folder_ / "a.exr", "linear");
  ASSERT_TRUE(photo) << photo.error().message();
  EXPECT_TRUE(photo->is_hdr());
  EXPECT_EQ(photo->linear.texels, image.texels);
  EXPECT_FALSE(read_photograph(folder_ / "a.exr", "srgb"));
  image.at(3, 2).g = std::numeric_limits<float>::quiet_NaN();
  ASSERT_TRUE(write_exr(folder_ / "b.exr", image));
  const auto bad = read_photograph(folder_ / "b.exr", "linear");
  ASSERT_FALSE(bad);
  EXPECT_NE(bad.error().where.find("(3, 2)"), std::string::npos);
  EXPECT_FALSE(read_photograph(folder_ / "missing.png", "srgb"));
}

/// A marker-like square with corners at (30, 30) .. (70, 70): black frame, grey inside, paper of `paper` around.
Photograph marker_sheet(float paper, float frame) {
  Photograph photo{RgbImage(100, 100, Rgb(paper, 0.9f * paper, 0.8f * paper)), {}, ResponseCurve::linear()};
  for (int y = 30; y < 70; ++y)
    for (int x = 30; x < 70; ++x)
      photo.linear.at(x, y) = Rgb(frame);
  return photo;
}
constexpr std::array<glm::dvec2, 4> kSquare{glm::dvec2(29.5, 29.5), glm::dvec2(69.5, 29.5), glm::dvec2(69.5, 69.5),
                                            glm::dvec2(29.5, 69.5)};

/// A print of luminance 2 on its paper before a dim wall, turned by 20 degrees; corners in `corner_px`.
Photograph bright_print_before_a_dim_wall(std::array<glm::dvec2, 4>& corner_px) {
  const auto print = marker_print("6X6_250", 5);
  const double side = 61.3, cell = side / print->cells_per_side, angle = 0.35;
  const glm::dvec2 origin(150.37, 90.71), right(std::cos(angle), std::sin(angle)), down(-right.y, right.x);
  const std::array<glm::dvec2, 4> unit{{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
  for (std::size_t k = 0; k < 4; ++k)
    corner_px[k] = origin + side * (unit[k].x * right + unit[k].y * down) - 0.5; // pixel centres are whole numbers
  const auto radiance = [&](const glm::dvec2& p) {
    const glm::dvec2 at(glm::dot(p - origin, right) / cell, glm::dot(p - origin, down) / cell);
    const glm::ivec2 c(glm::floor(at));
    const int n = print->cells_per_side;
    if (c.x >= 0 && c.y >= 0 && c.x < n && c.y < n)
      return print->white[static_cast<std::size_t>(c.y * n + c.x)] ? 2.0 : 0.05;
    return std::min(at.x, at.y) > -1.0 && std::max(at.x, at.y) < n + 1.0 ? 2.0 : 0.3;
  };
  Photograph photo;
  photo.linear = RgbImage(400, 300);
  for (int y = 0; y < 300; ++y)
    for (int x = 0; x < 400; ++x) {
      double sum = 0;
      for (int k = 0; k < 64; ++k)
        sum += radiance({x + (k % 8 + 0.5) / 8, y + (k / 8 + 0.5) / 8}) / 64;
      photo.linear.at(x, y) = Rgb(static_cast<float>(sum));
    }
  return photo;
}

TEST(MarkerPicture, corners_do_not_move_where_the_paper_is_much_brighter_than_the_picture) {
  std::array<glm::dvec2, 4> truth;
  const Photograph photo = bright_print_before_a_dim_wall(truth);
  const auto picture = picture_of_markers(photo, "6X6_250");
  ASSERT_TRUE(picture);
  const auto seen = find_markers(*picture, "6X6_250");
  ASSERT_TRUE(seen);
  ASSERT_EQ(seen->size(), 1u);
  for (std::size_t k = 0; k < 4; ++k)
    EXPECT_LT(glm::distance(seen->front().corner_px[k], truth[k]), 0.05) << k;
}

TEST(MarkerWhite, is_the_median_of_the_paper) {
  Photograph photo = marker_sheet(0.6f, 0.02f);
  for (int x = 20; x < 90; x += 7) // dirt on the paper
    photo.linear.at(x, 27) = Rgb(0.0f);
  const auto white = marker_white(photo, kSquare);
  ASSERT_TRUE(white) << white.error().message();
  EXPECT_EQ(*white, Rgb(0.6f, 0.9f * 0.6f, 0.8f * 0.6f));
}

TEST(MarkerWhite, refuses_what_is_no_white_paper) {
  EXPECT_FALSE(marker_white(marker_sheet(0.03f, 0.02f), kSquare));
  Photograph saturated = marker_sheet(1.0f, 0.02f);
  saturated.original = encode_picture(saturated.response, saturated.linear);
  const auto r = marker_white(saturated, kSquare);
  ASSERT_FALSE(r);
  EXPECT_NE(r.error().what.find("saturated"), std::string::npos);
  auto outside = kSquare;
  for (auto& p : outside)
    p += glm::dvec2(200, 0);
  EXPECT_FALSE(marker_white(marker_sheet(0.6f, 0.02f), outside));
}

TEST(MarkerScale, paper_in_the_photograph_over_paper_in_the_simulation) {
  // Irradiance pi on paper of reflectance 0.8 gives radiance 0.8 in every channel.
  const auto matched = scale_from_marker(Rgb(0.4f, 0.2f, 0.1f), Rgb(3.14159265f), 0.8, glm::dmat3(1.0));
  ASSERT_TRUE(matched);
  const Rgb white = matched->apply(Rgb(0.8f));
  EXPECT_NEAR(white.r, 0.4f, 1e-6f);
  EXPECT_NEAR(white.g, 0.2f, 1e-6f);
  EXPECT_NEAR(white.b, 0.1f, 1e-6f);
  // A colour matrix of the user's stays as it is; only the luminance is matched.
  glm::dmat3 warm(1.0);
  warm[0][0] = 1.2;
  const auto kept = scale_from_marker(Rgb(0.4f, 0.2f, 0.1f), Rgb(3.14159265f), 0.8, warm);
  ASSERT_TRUE(kept);
  EXPECT_EQ(kept->colour_matrix, warm);
  EXPECT_NEAR(luminance(kept->apply(Rgb(0.8f))), luminance(Rgb(0.4f, 0.2f, 0.1f)), 1e-6f);
  EXPECT_FALSE(scale_from_marker(Rgb(0.4f), Rgb(0.0f), 0.8, glm::dmat3(1.0)));
}

TEST(MarkerWhite, shared_photograph_shows_white_paper_around_each_marker) {
  const std::filesystem::path file =
      std::filesystem::path(DAYLIT_SOURCE_DIR) / "../shared/data/markers/singlemarkersoriginal.jpg";
  if (!std::filesystem::exists(file))
    GTEST_SKIP() << "the shared photograph is not here";
  const auto photo = read_photograph(file, "srgb");
  ASSERT_TRUE(photo) << photo.error().message();
  const auto seen = find_markers(photo->original, "6X6_250");
  ASSERT_TRUE(seen);
  EXPECT_EQ(seen->size(), 6u);
  for (const SeenMarker& m : *seen) {
    const auto white = marker_white(*photo, m.corner_px);
    ASSERT_TRUE(white) << m.id << ": " << white.error().message();
    EXPECT_GT(white->g, 0.2f) << m.id;
    EXPECT_LT(white->g, 1.0f) << m.id;
  }
}

} // namespace
} // namespace daylit
