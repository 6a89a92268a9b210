// What a pixel by rays shows is the mean over its area: edges of the sun's shadow, and folds as narrow as the pixel.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "torus_scene.h"

namespace daylit {
namespace {

using test::at;
using test::kHeight;
using test::kWidth;
using test::sun_through_the_window;
using Scene = test::TorusScene;

/// Share of the sun that the objects take from the room, and the objects' brightness, in a picture of that width.
Result<RenderedFrame> in_the_sun(int width) {
  Scene scene;
  scene.sun = sun_through_the_window();
  scene.camera = test::look_at({3.0, 4.6, 1.1}, {2.0, 3.4, 0.2}, width, width * kHeight / kWidth, 0.6);
  return scene.trace();
}

TEST(TracedRenderer, a_pixel_at_the_edge_of_the_suns_shadow_shows_the_mean_over_its_area) {
  constexpr int kFiner = 4;
  const auto coarse = in_the_sun(kWidth), fine = in_the_sun(kFiner * kWidth);
  ASSERT_TRUE(coarse && fine);
  int room_edges = 0, object_edges = 0, outlines = 0;
  double room_error = 0, object_error = 0, outline_error = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      float lost = 0, least = 1, most = 0, bright = 0, darkest = 1e9f, brightest = 0, cover = 0, least_cover = 1;
      for (int k = 0; k < kFiner * kFiner; ++k) {
        const DrawnPixel p = at(*fine, kFiner * x + k % kFiner, kFiner * y + k / kFiner);
        lost += p.lost_sun.g / (kFiner * kFiner), least = std::min(least, p.lost_sun.g),
                                                  most = std::max(most, p.lost_sun.g);
        bright += p.object.y / (kFiner * kFiner), cover = std::max(cover, p.object.w);
        least_cover = std::min(least_cover, p.object.w);
        darkest = std::min(darkest, p.object.y), brightest = std::max(brightest, p.object.y);
      }
      const DrawnPixel p = at(*coarse, x, y);
      if (p.object.w > 0.0f && p.object.w < 1.0f && most > 0.2f)
        ++outlines, outline_error += std::pow(static_cast<double>(p.lost_sun.g - lost), 2);
      if (cover == 0.0f && most - least > 0.2f)
        ++room_edges, room_error += std::pow(static_cast<double>(p.lost_sun.g - lost) / static_cast<double>(most), 2);
      if (least_cover == 1.0f && p.object.w == 1.0f && brightest > 2.0f * darkest)
        ++object_edges, object_error += std::pow(static_cast<double>((p.object.y - bright) / (brightest - darkest)), 2);
    }
  EXPECT_GT(room_edges, 50);
  EXPECT_LT(std::sqrt(room_error / room_edges), 0.13) << "0.19 where all lights start in the middle of the pixel";
  EXPECT_GT(outlines, 25);
  EXPECT_LT(std::sqrt(outline_error / outlines), 0.042) << "of the whole sun: 0.049 from one sample";
  EXPECT_GT(object_edges, 100);
  EXPECT_LT(std::sqrt(object_error / object_edges), 0.1) << "0.11";
}

/// An upright sheet, 0.3 m wide and high, in `folds` waves of that depth.
ObjectMesh folded_sheet(int folds, float depth) {
  ObjectMesh mesh;
  const int across = 16 * folds;
  for (int i = 0; i <= across; ++i) {
    const float s = static_cast<float>(i) / static_cast<float>(across);
    const float turn = 2.0f * std::numbers::pi_v<float> * static_cast<float>(folds);
    const glm::vec3 n = glm::normalize(glm::vec3(-depth * turn * std::cos(turn * s), 0.3f, 0.0f));
    for (const float z : {0.0f, 0.3f}) {
      mesh.positions.emplace_back(0.3f * s - 0.15f, depth * std::sin(turn * s), z);
      mesh.normals.push_back(n);
      mesh.reflectance.emplace_back(0.6f);
    }
    const auto k = static_cast<std::uint32_t>(2 * i);
    if (i < across)
      mesh.triangles.insert(mesh.triangles.end(), {{k, k + 3, k + 2}, {k, k + 1, k + 3}});
  }
  return mesh;
}

/// RMS over the mean square: brightness of the sheet's pixels, against the mean over their area of a finer picture.
double error_of_folds(int folds, const std::optional<DetectedSun>& sun) {
  constexpr int kFiner = 4;
  const auto drawn = [&](int width) {
    Scene scene;
    scene.sun = sun;
    scene.object = test::place(folded_sheet(folds, 0.01f), {2.0, 3.4, 0.02});
    scene.camera = test::look_at({2.0, 4.6, 0.5}, {2.0, 3.4, 0.17}, width, width * kHeight / kWidth, 0.6);
    return scene.trace();
  };
  const auto coarse = drawn(kWidth), fine = drawn(kFiner * kWidth);
  if (!coarse || !fine)
    return 1e9;
  double error = 0, light = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      float mean = 0, cover = 0;
      for (int k = 0; k < kFiner * kFiner; ++k) {
        const DrawnPixel p = at(*fine, kFiner * x + k % kFiner, kFiner * y + k / kFiner);
        mean += p.object.y / (kFiner * kFiner), cover += p.object.w / (kFiner * kFiner);
      }
      if (cover < 1.0f)
        continue;
      error += std::pow(static_cast<double>(at(*coarse, x, y).object.y - mean), 2);
      light += static_cast<double>(mean * mean);
    }
  return std::sqrt(error / light);
}

/// A dish of few facets, its smooth normals those of the sphere of 0.5 m that it is cut from.
ObjectMesh dish() {
  ObjectMesh mesh;
  constexpr std::uint32_t kAround = 20, kAcross = 5;
  for (std::uint32_t i = 0; i <= kAcross; ++i)
    for (std::uint32_t j = 0; j < kAround; ++j) {
      const double r = 0.25 * i / kAcross, a = 2.0 * std::numbers::pi * j / kAround;
      const glm::dvec3 p(r * std::cos(a), r * std::sin(a), 0.5 - std::sqrt(0.25 - r * r));
      mesh.positions.emplace_back(p);
      mesh.normals.emplace_back(glm::normalize(glm::dvec3(0, 0, 0.5) - p));
      mesh.reflectance.emplace_back(0.7f);
    }
  for (std::uint32_t i = 0; i < kAcross; ++i)
    for (std::uint32_t j = 0; j < kAround; ++j) {
      const std::uint32_t a = i * kAround + j, b = i * kAround + (j + 1) % kAround;
      mesh.triangles.push_back({a, a + kAround, b + kAround});
      mesh.triangles.push_back({a, b + kAround, b});
    }
  return mesh;
}

TEST(TracedRenderer, the_facets_of_a_dish_cast_no_specks_into_it) {
  Scene scene;
  scene.sun = sun_through_the_window();
  scene.object = test::place(dish(), {2.0, 3.4, 0.05});
  scene.camera = test::look_at({2.9, 4.0, 1.1}, {2.0, 3.4, 0.08}, 256, 248, 0.55);
  const auto frame = scene.trace();
  ASSERT_TRUE(frame) << frame.error().message();
  int lit = 0, specks = 0;
  for (int y = 1; y + 1 < frame->height_px; ++y)
    for (int x = 1; x + 1 < frame->width_px; ++x) {
      std::array<float, 9> v{};
      bool inside = true;
      for (int k = 0; k < 9; ++k) {
        const glm::vec4 p = at(*frame, x + k % 3 - 1, y + k / 3 - 1).object;
        inside = inside && p.w == 1.0f;
        v[static_cast<std::size_t>(k)] = p.y;
      }
      const float middle = v[4];
      std::ranges::sort(v);
      lit += inside;
      specks += inside && middle < 0.97f * v[4];
    }
  EXPECT_GT(lit, 5000);
  EXPECT_LE(specks, 3) << "14 where the facet on one side of a pixel counts alone";
}

TEST(TracedRenderer, folds_as_narrow_as_pixels_show_the_mean_over_the_pixels) {
  EXPECT_LT(error_of_folds(6, sun_through_the_window()), 0.027) << "0.036 where all lights start at one sample";
  EXPECT_LT(error_of_folds(20, sun_through_the_window()), 0.25) << "0.48 with one point per pixel";
}

/// RMS over the mean square: brightness of the sheet's pixels with and without the sampling grid.
double change_by_grid(int folds, float depth) {
  Scene scene;
  scene.object = test::place(folded_sheet(folds, depth), {2.0, 3.4, 0.02});
  scene.camera = test::look_at({2.0, 4.4, 0.5}, {2.0, 3.4, 0.17}, kWidth, kHeight, 0.45);
  const auto with = scene.trace(), without = scene.trace(false);
  if (!with || !without)
    return 1e9;
  double error = 0, light = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const double exact = static_cast<double>(at(*without, x, y).object.y);
      error += std::pow(static_cast<double>(at(*with, x, y).object.y) - exact, 2);
      light += exact * exact;
    }
  return std::sqrt(error / light);
}

TEST(TracedRenderer, folds_a_few_pixels_wide_look_as_without_a_grid) {
  EXPECT_LT(change_by_grid(10, 0.02f), 0.015) << "0.04 where neighbours on other folds are believed";
  EXPECT_LT(change_by_grid(24, 0.01f), 0.025) << "0.06";
}

/// A level plate of 0.6 m with narrow triangles 8 cm above it, whose shadows end in tips.
ObjectMesh plate_below_triangles() {
  ObjectMesh mesh;
  const auto add = [&](std::initializer_list<glm::vec3> corners) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (const glm::vec3& p : corners) {
      mesh.positions.push_back(p);
      mesh.normals.emplace_back(0.0f, 0.0f, 1.0f);
      mesh.reflectance.emplace_back(0.6f);
    }
    for (std::uint32_t k = 2; k < corners.size(); ++k)
      mesh.triangles.push_back({first, first + k - 1, first + k});
  };
  add({{-0.3f, -0.3f, 0}, {0.3f, -0.3f, 0}, {0.3f, 0.3f, 0}, {-0.3f, 0.3f, 0}});
  for (int k = 0; k < 25; ++k) {
    const float x = 0.097f * static_cast<float>(k % 5) - 0.2f, y = 0.103f * static_cast<float>(k / 5) - 0.2f;
    const float c = 0.04f * std::cos(static_cast<float>(k)), d = 0.04f * std::sin(static_cast<float>(k));
    add({{x + c, y + d, 0.08f},
         {x - c - 0.3f * d, y - d + 0.3f * c, 0.08f},
         {x - c + 0.3f * d, y - d - 0.3f * c, 0.08f}});
  }
  return mesh;
}

TEST(TracedRenderer, tips_of_the_suns_shadows_between_grid_points_are_not_cut_off) {
  Scene scene;
  scene.sun = sun_through_the_window();
  scene.object = test::place(plate_below_triangles(), {2.0, 3.4, 0.02});
  scene.camera = test::look_at({2.0, 3.3, 1.5}, {2.0, 3.4, 0.0}, kWidth, kHeight, 0.6);
  const auto with = scene.trace(), without = scene.trace(false);
  ASSERT_TRUE(with && without);
  int shaded = 0, missed = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const float a = at(*with, x, y).object.y, b = at(*without, x, y).object.y;
      shaded += b > 0.0f && b < 0.4f;
      missed += b > 0.0f && std::abs(a - b) > 0.3f * b;
    }
  EXPECT_GT(shaded, 500);
  EXPECT_LT(missed, 30) << "49 where only the corners of a block are asked";
}

} // namespace
} // namespace daylit
