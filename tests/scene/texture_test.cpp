// Pictures on surfaces: known texels, means over levels, borders.

#include "scene/material/texture.h"

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace daylit {
namespace {

Rgb8Image noise(int width, int height, unsigned seed) {
  std::mt19937 random(seed);
  Rgb8Image image{width, height, {}};
  for (int k = 0; k < 3 * width * height; ++k)
    image.bytes.push_back(static_cast<std::uint8_t>(random()));
  return image;
}

glm::dvec3 mean(const Rgb8Image& image, TextureCoding coding) {
  glm::dvec3 sum(0.0);
  for (std::size_t k = 0; k < image.bytes.size(); ++k) {
    const float v = static_cast<float>(image.bytes[k]) / 255.0f;
    sum[static_cast<int>(k % 3)] += static_cast<double>(coding == TextureCoding::srgb ? srgb_decode(v) : v);
  }
  return sum / (static_cast<double>(image.bytes.size()) / 3.0);
}

constexpr TextureCoding kCodings[] = {TextureCoding::srgb, TextureCoding::linear};

TEST(Texture, middles_of_texels_have_the_picture_s_values) {
  for (const TextureCoding coding : kCodings) {
    const Rgb8Image image = noise(7, 5, 1);
    const auto texture = Texture::make(image, coding);
    ASSERT_TRUE(texture);
    for (int y = 0; y < 5; ++y)
      for (int x = 0; x < 7; ++x) {
        const Rgb seen = texture->at({(static_cast<float>(x) + 0.5f) / 7.0f, (static_cast<float>(y) + 0.5f) / 5.0f});
        for (int c = 0; c < 3; ++c) {
          const float v = static_cast<float>(image.bytes[static_cast<std::size_t>(3 * (7 * y + x) + c)]) / 255.0f;
          EXPECT_NEAR(seen[c], coding == TextureCoding::srgb ? srgb_decode(v) : v, 1e-5f);
        }
      }
  }
}

TEST(Texture, half_way_between_two_texels_is_their_mean_in_linear_light) {
  const auto texture = Texture::make({2, 1, {0, 0, 0, 255, 255, 255}}, TextureCoding::srgb);
  EXPECT_NEAR(texture->at({0.5f, 0.5f}).g, 0.5f, 1e-6f) << "not the light of code 128, 0.216";
}

TEST(Texture, every_level_keeps_the_mean_in_linear_light) {
  // One code of sRGB is at most 0.0072 of linear light; rounding errors of many texels cancel.
  for (const TextureCoding coding : kCodings)
    for (const auto& [width, height] : {std::pair(64, 64), std::pair(37, 21), std::pair(5, 96), std::pair(1, 9)}) {
      const Rgb8Image image = noise(width, height, 3);
      const auto texture = Texture::make(image, coding);
      const glm::dvec3 expected = mean(image, coding);
      const Rgb whole = texture->at({0.3f, 0.6f}, 1.0f);
      const int side = std::max(width, height);
      for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(whole[c], expected[c], 0.004) << width << " x " << height;
        for (float level = 1.0f; level < static_cast<float>(side); level *= 2.0f) { // sampled densely
          double sum = 0.0;
          for (int y = 0; y < 64; ++y)
            for (int x = 0; x < 64; ++x)
              sum += static_cast<double>(
                  texture->at({(static_cast<float>(x) + 0.5f) / 64.0f, (static_cast<float>(y) + 0.5f) / 64.0f},
                              level / static_cast<float>(side))[c]);
          EXPECT_NEAR(sum / 4096.0, expected[c], 0.02) << width << " x " << height << ", " << level << " texels";
        }
      }
    }
}

TEST(Texture, a_constant_picture_is_constant_at_every_footprint) {
  for (const TextureCoding coding : kCodings) {
    const auto texture = Texture::make({33, 17, std::vector<std::uint8_t>(3 * 33 * 17, 90)}, coding);
    const float expected = coding == TextureCoding::srgb ? srgb_decode(90.0f / 255.0f) : 90.0f / 255.0f;
    for (const float width : {0.0f, 0.01f, 0.1f, 0.7f, 5.0f})
      EXPECT_NEAR(texture->at({0.21f, -3.4f}, width).b, expected, 1e-6f);
  }
}

TEST(Texture, beyond_its_edge_a_picture_is_repeated_mirrored_or_held) {
  const Rgb8Image ramp{4, 1, {0, 0, 0, 85, 85, 85, 170, 170, 170, 255, 255, 255}};
  const auto at = [&](TextureWrap wrap, float u) {
    return Texture::make(ramp, TextureCoding::linear, wrap, TextureWrap::clamp)->at({u, 0.5f}).r;
  };
  EXPECT_NEAR(at(TextureWrap::repeat, 1.125f), 0.0f, 1e-5f);
  EXPECT_NEAR(at(TextureWrap::repeat, -0.125f), 1.0f, 1e-5f);
  EXPECT_NEAR(at(TextureWrap::repeat, 0.0f), 0.5f, 1e-5f) << "between the last and the first";
  EXPECT_NEAR(at(TextureWrap::mirror, 1.125f), 1.0f, 1e-5f);
  EXPECT_NEAR(at(TextureWrap::mirror, 1.375f), 2.0f / 3.0f, 1e-5f);
  EXPECT_NEAR(at(TextureWrap::mirror, -0.375f), 1.0f / 3.0f, 1e-5f);
  EXPECT_NEAR(at(TextureWrap::mirror, 2.125f), 0.0f, 1e-5f);
  EXPECT_NEAR(at(TextureWrap::clamp, 7.0f), 1.0f, 1e-5f);
  EXPECT_NEAR(at(TextureWrap::clamp, 0.0f), 0.0f, 1e-5f);
}

TEST(Texture, a_wider_footprint_blurs_a_checker_pattern_to_grey) {
  Rgb8Image checks{64, 64, {}};
  for (int k = 0; k < 64 * 64; ++k)
    for (int c = 0; c < 3; ++c)
      checks.bytes.push_back((k + k / 64) % 2 ? 255 : 0);
  const auto texture = Texture::make(checks, TextureCoding::srgb);
  float before = 1.0f;
  for (const float texels : {1.0f, 1.25f, 1.5f, 1.75f, 2.0f}) {
    const float contrast = std::fabs(texture->at({0.5f / 64.0f, 0.5f / 64.0f}, texels / 64.0f).r - 0.5f);
    EXPECT_LT(contrast, before);
    before = contrast;
  }
  EXPECT_LT(before, 0.01f) << "half of the light, within a code";
}

TEST(Texture, coordinates_that_are_no_numbers_give_a_texel) {
  const auto texture = Texture::make(noise(8, 8, 5), TextureCoding::srgb);
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  for (const glm::vec2 uv : {glm::vec2(nan, 0.0f), glm::vec2(0.0f, inf), glm::vec2(1e38f, -1e38f)})
    for (const float width : {0.0f, nan, inf, -1.0f})
      EXPECT_TRUE(std::isfinite(texture->at(uv, width).r));
}

TEST(Texture, pictures_without_texels_are_refused) {
  EXPECT_FALSE(Texture::make({0, 4, {}}, TextureCoding::srgb));
  EXPECT_FALSE(Texture::make({4, 4, std::vector<std::uint8_t>(47)}, TextureCoding::srgb));
}

TEST(Texture, memory_is_four_bytes_for_a_texel) {
  const auto texture = Texture::make(noise(256, 128, 6), TextureCoding::srgb);
  EXPECT_NEAR(static_cast<double>(texture->bytes()) / (256.0 * 128.0), 4.0, 0.05);
}

} // namespace
} // namespace daylit
