#include <cmath>
#include <cstring>
#include <random>

#include <gtest/gtest.h>

#include "runtime/composite/camera_match.h"

namespace daylit {
namespace {

constexpr int kWidth = 64, kHeight = 48;

/// A grey photograph; left of x = 24 an object of radiance 1, right of x = 48 a shadow of half the light, both sharp.
struct Case {
  RgbImage photo{kWidth, kHeight, Rgb(0.2f)};
  Composite composite;

  Case() { reset(); }
  void reset() {
    composite.picture = photo;
    composite.touched.assign(photo.texels.size(), 0);
    composite.coverage.assign(photo.texels.size(), 0.0f);
    composite.object_pixels = composite.shadow_pixels = 0;
    for (int y = 8; y < 40; ++y)
      for (int x = 0; x < kWidth; ++x)
        if (x < 24 || x >= 48) {
          const std::size_t i = static_cast<std::size_t>(y * kWidth + x);
          composite.touched[i] = x < 24 ? 2 : 1;
          composite.coverage[i] = x < 24 ? 1.0f : 0.0f;
          composite.picture.texels[i] = x < 24 ? Rgb(1.0f) : 0.5f * photo.texels[i];
          ++(x < 24 ? composite.object_pixels : composite.shadow_pixels);
        }
  }
};

constexpr float kThreshold = 1.0f / 510.0f;

bool same_bits(const Rgb& a, const Rgb& b) { return std::memcmp(&a, &b, sizeof a) == 0; }

TEST(CameraMatch, a_blurred_edge_is_the_normal_distribution) {
  Case c;
  constexpr double kSigma = 1.5;
  match_blur(c.photo, kSigma, kThreshold, c.composite);
  for (int x = 18; x < 30; ++x) {
    const double inside = 0.5 * std::erfc((x + 0.5 - 24.0) / (kSigma * std::sqrt(2.0)));
    EXPECT_NEAR(c.composite.coverage[24 * kWidth + static_cast<std::size_t>(x)], inside, 0.01) << x;
    EXPECT_NEAR(c.composite.picture.at(x, 24).g, 0.2 + 0.8 * inside, 0.01) << x;
  }
  for (int x = 42; x < 54; ++x) {
    const double lit = 0.5 * std::erfc((x + 0.5 - 48.0) / (kSigma * std::sqrt(2.0)));
    EXPECT_NEAR(c.composite.picture.at(x, 24).r, 0.1 + 0.1 * lit, 0.002) << x;
  }
  EXPECT_GT(c.composite.object_pixels, 24u * 32u);
  EXPECT_GT(c.composite.shadow_pixels, 16u * 32u);
}

TEST(CameraMatch, blur_leaves_the_photograph_sharp_and_out_of_reach_untouched) {
  Case c;
  std::mt19937 random(3);
  std::uniform_real_distribution<float> level(0.1f, 0.9f);
  for (Rgb& texel : c.photo.texels)
    texel = Rgb(level(random));
  c.reset();
  match_blur(c.photo, 1.0, kThreshold, c.composite);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const std::size_t i = static_cast<std::size_t>(y * kWidth + x);
      const bool far_away = y < 5 || y >= 43 || (x >= 27 && x < 45);
      if (far_away) {
        EXPECT_TRUE(same_bits(c.composite.picture.texels[i], c.photo.texels[i])) << x << " " << y;
        EXPECT_EQ(c.composite.touched[i], 0);
      }
    }
  for (int x = 0; x < 20; ++x) // nothing of the texture behind shines through the object
    EXPECT_NEAR(c.composite.picture.at(x, 24).g, 1.0f, 1e-5f);
}

TEST(CameraMatch, without_blur_and_noise_nothing_changes) {
  Case c;
  const Composite before = c.composite;
  match_blur(c.photo, 0.0, kThreshold, c.composite);
  match_noise(c.photo, {}, 1, c.composite);
  EXPECT_EQ(0, std::memcmp(before.picture.texels.data(), c.composite.picture.texels.data(),
                           before.picture.texels.size() * sizeof(Rgb)));
  EXPECT_EQ(before.touched, c.composite.touched);
}

/// Mean square deviation from `mean` in columns first..last of the object's and shadow's rows, over many frames.
double measured_variance(const CameraNoise& noise, float coverage, int first, int last, double mean) {
  double sum = 0;
  int count = 0;
  std::mt19937 random(8);
  std::normal_distribution<double> normal;
  for (std::uint64_t frame = 1; frame <= 20; ++frame) {
    Case c;
    for (Rgb& texel : c.photo.texels) // a real photograph is noisy itself
      for (int k = 0; k < 3; ++k)
        texel[k] += static_cast<float>(std::sqrt(noise.variance(0.2)) * normal(random));
    c.reset();
    for (std::size_t i = 0; i < c.composite.touched.size(); ++i)
      if (c.composite.touched[i] == 2) {
        c.composite.coverage[i] = coverage;
        c.composite.picture.texels[i] = (1.0f - coverage) * c.photo.texels[i] + Rgb(coverage);
      }
    match_noise(c.photo, noise, frame, c.composite);
    for (int y = 8; y < 40; ++y)
      for (int x = first; x < last; ++x)
        for (int k = 0; k < 3; ++k) {
          const double d = static_cast<double>(c.composite.picture.at(x, y)[k]) - mean;
          sum += d * d;
          ++count;
        }
  }
  return sum / count;
}

TEST(CameraMatch, every_touched_pixel_has_the_deviation_of_its_brightness) {
  const CameraNoise sensor{.floor = 0.002, .photon = 1e-4, .relative = 0.0}, gain{.relative = 0.01};
  for (const CameraNoise& noise : {sensor, gain}) {
    EXPECT_NEAR(measured_variance(noise, 1.0f, 0, 24, 1.0) / noise.variance(1.0), 1.0, 0.03);
    EXPECT_NEAR(measured_variance(noise, 0.5f, 0, 24, 0.6) / noise.variance(0.6), 1.0, 0.03);      // silhouettes
    EXPECT_NEAR(measured_variance(noise, 1.0f, 48, kWidth, 0.1) / noise.variance(0.1), 1.0, 0.03); // the shadow
  }
}

TEST(CameraMatch, noise_is_the_same_for_a_frame_another_for_the_next_and_none_beside) {
  Case a, b, c;
  const CameraNoise noise{.relative = 0.02};
  match_noise(a.photo, noise, 7, a.composite);
  match_noise(b.photo, noise, 7, b.composite);
  match_noise(c.photo, noise, 8, c.composite);
  std::size_t differ = 0;
  for (std::size_t i = 0; i < a.photo.texels.size(); ++i) {
    EXPECT_TRUE(same_bits(a.composite.picture.texels[i], b.composite.picture.texels[i]));
    differ += a.composite.picture.texels[i] != c.composite.picture.texels[i];
    if (!a.composite.touched[i]) {
      EXPECT_TRUE(same_bits(a.composite.picture.texels[i], a.photo.texels[i]));
    }
    EXPECT_GE(a.composite.picture.texels[i].r, 0.0f);
  }
  EXPECT_GT(differ, a.composite.object_pixels / 2);
}

} // namespace
} // namespace daylit
