#include "runtime/composite/camera_match.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>

#include <opencv2/imgproc.hpp>

#include "scene/core/parallel.h"

#include "runtime/composite/change_picture.h"

namespace daylit {

namespace {

constexpr double kKernelRadius = 3.0; // of the point spread, in standard deviations

PixelBox touched_box(const Composite& c) {
  const int width = c.picture.width;
  PixelBox box;
  for (int y = 0; y < c.picture.height; ++y) {
    const auto row = c.touched.begin() + static_cast<std::ptrdiff_t>(y) * width;
    const auto is_touched = [](std::uint8_t t) { return t != 0; };
    const auto first = std::find_if(row, row + width, is_touched);
    if (first == row + width)
      continue;
    int last = width;
    while (!row[last - 1])
      --last;
    box.include({static_cast<int>(first - row), y, last, y + 1});
  }
  return box;
}

/// The two layers over the photograph: picture = drawn + (1 - coverage) photo.
struct Layers {
  cv::Mat drawn, coverage;
};

Layers layers_in(const PixelBox& box, const PhotoPixels& photo, const Composite& c) {
  Layers layers{cv::Mat(box.height(), box.width(), CV_32FC3), cv::Mat(box.height(), box.width(), CV_32FC1)};
  parallel_for(box.y0, box.y1, [&](int y) {
    for (int x = box.x0; x < box.x1; ++x) {
      const std::size_t i = photo.index(x, y);
      const float coverage = c.coverage[i];
      const Rgb drawn = c.picture.texels[i] - (1.0f - coverage) * photo[i];
      layers.drawn.at<cv::Vec3f>(y - box.y0, x - box.x0) = {drawn.r, drawn.g, drawn.b};
      layers.coverage.at<float>(y - box.y0, x - box.x0) = coverage;
    }
  });
  return layers;
}

/// splitmix64 (Steele, Lea, Flood 2014).
std::uint64_t mixed(std::uint64_t x) {
  x += 0x9E3779B97F4A7C15ull;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ull;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBull;
  return x ^ (x >> 31);
}

/// Box & Muller 1958.
float normal_deviate(std::uint64_t key) {
  const std::uint64_t bits = mixed(key);
  const float u = (static_cast<float>(bits >> 40) + 0.5f) * 0x1p-24f;
  const float v = static_cast<float>(bits & 0xFFFFFFu) * 0x1p-24f;
  return std::sqrt(-2.0f * std::log(u)) * std::cos(2.0f * std::numbers::pi_v<float> * v);
}

} // namespace

void match_blur(const PhotoPixels& photo, double sigma_px, float threshold, Composite& c) {
  if (sigma_px <= 0.0)
    return;
  PixelBox box = touched_box(c);
  if (box.empty())
    return;
  const int radius = static_cast<int>(std::ceil(kKernelRadius * sigma_px));
  box = PixelBox{box.x0 - radius, box.y0 - radius, box.x1 + radius, box.y1 + radius}.clipped(photo.width(),
                                                                                             photo.height());
  Layers layers = layers_in(box, photo, c);
  const cv::Size kernel(2 * radius + 1, 2 * radius + 1);
  cv::GaussianBlur(layers.drawn, layers.drawn, kernel, sigma_px, sigma_px, cv::BORDER_REPLICATE);
  cv::GaussianBlur(layers.coverage, layers.coverage, kernel, sigma_px, sigma_px, cv::BORDER_REPLICATE);
  std::atomic<std::size_t> object_pixels{0}, shadow_pixels{0};
  parallel_for(box.y0, box.y1, [&](int y) {
    std::size_t objects = 0, shadows = 0;
    for (int x = box.x0; x < box.x1; ++x) {
      const std::size_t i = photo.index(x, y);
      const cv::Vec3f drawn = layers.drawn.at<cv::Vec3f>(y - box.y0, x - box.x0);
      const float coverage = std::clamp(layers.coverage.at<float>(y - box.y0, x - box.x0), 0.0f, 1.0f);
      const Rgb before = photo[i];
      const Rgb after = glm::max(Rgb(drawn[0], drawn[1], drawn[2]) + (1.0f - coverage) * before, Rgb(0.0f));
      const bool written = exceeds(before, after, threshold), object = written && coverage >= kLeastCoverage;
      c.picture.texels[i] = written ? after : before;
      c.coverage[i] = coverage;
      c.touched[i] = object ? 2 : written ? 1 : 0;
      objects += object;
      shadows += written && !object;
    }
    object_pixels += objects;
    shadow_pixels += shadows;
  });
  c.object_pixels = object_pixels;
  c.shadow_pixels = shadow_pixels;
}

void match_noise(const PhotoPixels& photo, const CameraNoise& noise, std::uint64_t seed, Composite& c) {
  if (!noise.any())
    return;
  parallel_for(0, photo.height(), [&](int y) {
    for (int x = 0; x < photo.width(); ++x) {
      const std::size_t i = photo.index(x, y);
      if (!c.touched[i])
        continue;
      Rgb& value = c.picture.texels[i];
      for (int k = 0; k < 3; ++k) {
        const float before = photo[i][k];
        // Fraction of the photograph's deviation that is left in the pixel: what shows through, or what is darkened.
        const float kept = c.touched[i] == 2 ? 1.0f - c.coverage[i] : before > 0.0f ? value[k] / before : 0.0f;
        const double missing = noise.variance(value[k]) - static_cast<double>(kept * kept) * noise.variance(before);
        if (missing > 0.0)
          value[k] = std::max(0.0f, value[k] + static_cast<float>(std::sqrt(missing)) *
                                                   normal_deviate(mixed(seed) ^ (3 * i + static_cast<std::size_t>(k))));
      }
    }
  });
}

} // namespace daylit
