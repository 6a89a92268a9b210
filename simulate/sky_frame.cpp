#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <glm/geometric.hpp>

#include "scene/core/parallel.h"
#include "scene/sky/sky.h"
#include "simulate/low_discrepancy.h"
#include "simulate/picture.h"

namespace daylit {

namespace {

constexpr int kSubpixels = 4;       // per axis: the sky varies little over a pixel, the horizon crosses some
constexpr int kDiscPoints = 100000; // of equal area on the sun

Rgb pixel_mean(const AnalyticSky& sky, const LensModel& lens, int x, int y) {
  glm::dvec3 sum(0.0);
  double weight = 0.0;
  for (int j = 0; j < kSubpixels; ++j)
    for (int i = 0; i < kSubpixels; ++i) {
      const glm::dvec2 at(x - 0.5 + (i + 0.5) / kSubpixels, y - 0.5 + (j + 0.5) / kSubpixels);
      const auto ray = lens.unproject(at);
      if (!ray)
        continue;
      const double w = lens.solid_angle_density(at);
      sum += w * glm::dvec3(sky.sky_radiance(glm::normalize(lens.world_from_camera * *ray)));
      weight += w;
    }
  return weight > 0.0 ? Rgb(sum / weight) : Rgb(0.0f);
}

void splat_sun(const SunDisc& sun, const SkyGeometry& geometry, RgbImage& image) {
  std::vector<std::pair<std::size_t, int>> hits; // texel, points; a sun covers few texels
  for (const glm::dvec3& d : disc_points(sun, kDiscPoints)) {
    const auto texel = geometry.texel(d);
    if (!texel)
      continue;
    auto at = std::find_if(hits.begin(), hits.end(), [&](const auto& h) { return h.first == *texel; });
    if (at == hits.end())
      hits.emplace_back(*texel, 1);
    else
      ++at->second;
  }
  for (const auto& [texel, points] : hits)
    if (const float omega = geometry.solid_angle_sr()[texel]; omega > 0.0f)
      image.texels[texel] += sun.radiance() * static_cast<float>(sun.solid_angle_sr() * points / kDiscPoints) / omega;
}

} // namespace

Result<RgbImage> render_sky_frame(const AnalyticSky& sky, const LensModel& lens) {
  const auto geometry = SkyGeometry::make(lens.width_px, lens.height_px, FisheyeProjection{lens, 0.0}, "sky camera");
  if (!geometry)
    return geometry.error();
  RgbImage image(lens.width_px, lens.height_px);
  parallel_for(0, image.height, [&](int y) {
    for (int x = 0; x < image.width; ++x)
      image.at(x, y) = pixel_mean(sky, lens, x, y);
  });
  if (sky.model().sun)
    splat_sun(*sky.model().sun, **geometry, image);
  return image;
}

RgbImage render_sky_panorama(const AnalyticSky& sky, int height) {
  const SkyImage plain = sky_raster(sky, height);
  RgbImage image = plain.image();
  if (sky.model().sun)
    splat_sun(*sky.model().sun, *plain.geometry(), image);
  return image;
}

namespace {

/// Box & Muller 1958.
double normal_deviate(std::uint32_t key) {
  const double u = (mix_bits(key) + 0.5) * 0x1p-32, v = mix_bits(key ^ 0x5EEDu) * 0x1p-32;
  return std::sqrt(-2.0 * std::log(u)) * std::cos(2.0 * std::numbers::pi * v);
}

} // namespace

void add_sensor_noise(RgbImage& image, double relative_deviation, std::uint32_t seed) {
  if (relative_deviation <= 0.0)
    return;
  for (std::size_t i = 0; i < image.texels.size(); ++i)
    for (int c = 0; c < 3; ++c) {
      const double normal =
          normal_deviate(combine_keys(seed, static_cast<std::uint32_t>(3 * i + static_cast<std::size_t>(c))));
      image.texels[i][c] = std::max(0.0f, image.texels[i][c] * static_cast<float>(1.0 + relative_deviation * normal));
    }
}

void add_depth_noise(DepthPicture& depth, double noise_m, std::uint32_t seed) {
  if (noise_m <= 0.0)
    return;
  for (std::size_t i = 0; i < depth.z_m.size(); ++i) {
    const auto z = static_cast<double>(depth.z_m[i]);
    const double noise = noise_m * z * z * normal_deviate(combine_keys(seed, static_cast<std::uint32_t>(i)));
    depth.z_m[i] = static_cast<float>(std::max(z + noise, 0.0));
  }
}

} // namespace daylit
