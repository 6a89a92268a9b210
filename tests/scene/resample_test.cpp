#include "scene/image/resample.h"

#include <algorithm>
#include <random>

#include <gtest/gtest.h>

namespace daylit {
namespace {

RgbImage noise(int width, int height) {
  RgbImage image(width, height);
  std::mt19937 random(11);
  std::uniform_real_distribution<float> value(0.0f, 4.0f);
  for (Rgb& c : image.texels)
    c = Rgb(value(random), value(random), value(random));
  return image;
}

/// The mean over the area of a new pixel, all old pixels looked at.
Rgb mean_over(const RgbImage& image, int width, int height, int x, int y) {
  const double rx = static_cast<double>(image.width) / width, ry = static_cast<double>(image.height) / height;
  const auto overlap = [](double from, double to, int i) {
    return std::max(0.0, std::min(to, i + 1.0) - std::max(from, double(i)));
  };
  glm::dvec3 sum(0.0);
  for (int v = 0; v < image.height; ++v)
    for (int u = 0; u < image.width; ++u)
      sum += overlap(x * rx, (x + 1) * rx, u) * overlap(y * ry, (y + 1) * ry, v) * glm::dvec3(image.at(u, v));
  return Rgb(sum / (rx * ry));
}

TEST(Resample, every_pixel_is_the_mean_over_its_area) {
  const RgbImage image = noise(13, 7);
  for (const auto& [width, height] : {std::pair{13, 7}, {5, 3}, {1, 1}, {12, 6}, {26, 14}, {31, 20}, {13, 2}}) {
    const RgbImage sized = resampled_by_area(image, width, height);
    ASSERT_EQ(sized.texels.size(), static_cast<std::size_t>(width) * height);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x)
        for (int c = 0; c < 3; ++c)
          ASSERT_NEAR(sized.at(x, y)[c], mean_over(image, width, height, x, y)[c], 1e-5f)
              << width << " x " << height << " at " << x << ", " << y;
  }
}

TEST(Resample, its_own_size_keeps_every_bit) {
  const RgbImage image = noise(9, 11);
  EXPECT_EQ(resampled_by_area(image, 9, 11).texels, image.texels);
}

} // namespace
} // namespace daylit
