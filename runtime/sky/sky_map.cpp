#include "runtime/sky/sky_map.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <utility>

#include <glm/geometric.hpp>

#include "scene/core/parallel.h"

namespace daylit {

namespace {
constexpr double kPi = std::numbers::pi;
// A texel that image pixels cover by less than this fraction of its solid angle lies at the border of the field or in
// an image coarser than the map: the nearest pixel describes it better than the few that fell into it.
constexpr double kCoveredFraction = 0.5;
} // namespace

/// The inverse of position(): theta = pi v, azimuth = 2 pi (1/2 - u).
glm::dvec3 SkyMap::direction(double column, double row) const {
  const double theta = kPi * row / height, azimuth = 2.0 * kPi * (0.5 - column / width);
  return {std::sin(theta) * std::cos(azimuth), std::sin(theta) * std::sin(azimuth), std::cos(theta)};
}

glm::dvec2 SkyMap::position(const glm::dvec3& d) const {
  double column = (0.5 - std::atan2(d.y, d.x) / (2.0 * kPi)) * width;
  if (column >= width)
    column -= width;
  return {std::max(column, 0.0), std::acos(std::clamp(d.z, -1.0, 1.0)) / kPi * height};
}

/// Of a texel: 2 pi / width (cos theta_upper - cos theta_lower), exact.
double SkyMap::solid_angle_sr(int row) const {
  return 2.0 * kPi / width * (std::cos(kPi * row / height) - std::cos(kPi * (row + 1) / height));
}

/// Bilinear in (azimuth, theta); around the seam, and clamped at the poles.
Rgb SkyMap::interpolate(const glm::dvec3& d) const {
  const glm::dvec2 p = position(d) - 0.5;
  const double fx = std::floor(p.x), fy = std::floor(p.y);
  const float s = static_cast<float>(p.x - fx), t = static_cast<float>(p.y - fy);
  const int x0 = (static_cast<int>(fx) + width) % width, x1 = (x0 + 1) % width;
  const int y0 = std::clamp(static_cast<int>(fy), 0, height - 1),
            y1 = std::clamp(static_cast<int>(fy) + 1, 0, height - 1);
  return (1.0f - t) * ((1.0f - s) * at(x0, y0) + s * at(x1, y0)) + t * ((1.0f - s) * at(x0, y1) + s * at(x1, y1));
}

namespace {

/// Mean of four texels by solid angle: both of a row have the same, so that only rows are weighted.
void halve(const SkyMap& fine, SkyMap& coarse) {
  coarse.width = fine.width / 2;
  coarse.height = fine.height / 2;
  coarse.radiance.resize(static_cast<std::size_t>(coarse.width) * coarse.height);
  parallel_for(tbb::blocked_range<int>(0, coarse.height, 16), [&](const tbb::blocked_range<int>& rows) {
    for (int y = rows.begin(); y != rows.end(); ++y) {
      const double upper = fine.solid_angle_sr(2 * y), lower = fine.solid_angle_sr(2 * y + 1);
      const float fraction = static_cast<float>(0.5 * upper / (upper + lower));
      for (int x = 0; x < coarse.width; ++x)
        coarse.radiance[static_cast<std::size_t>(y) * coarse.width + x] =
            fraction * (fine.at(2 * x, 2 * y) + fine.at(2 * x + 1, 2 * y)) +
            (0.5f - fraction) * (fine.at(2 * x, 2 * y + 1) + fine.at(2 * x + 1, 2 * y + 1));
    }
  });
}

} // namespace

void halve_sky_map(std::vector<SkyMap>& levels) {
  std::size_t count = 1;
  for (int height = levels[0].height; height > 4 && height % 2 == 0; height /= 2)
    ++count;
  levels.resize(count);
  for (std::size_t k = 1; k < count; ++k)
    halve(levels[k - 1], levels[k]);
}

std::vector<SkyMap> sky_map_pyramid(SkyMap map) {
  std::vector<SkyMap> levels;
  levels.push_back(std::move(map));
  halve_sky_map(levels);
  return levels;
}

/// Of each pixel; kFill outside the field.
std::vector<std::uint32_t> SkyResampler::find_texels(const SkyImage& sky, const SkyMap& map) {
  pixel_direction_ = daylit::pixel_directions(sky);
  std::vector<std::uint32_t> texels(pixel_direction_.size(), kFill);
  parallel_for(tbb::blocked_range<std::size_t>(0, texels.size()), [&](const auto& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      if (pixel_direction_[i] == glm::vec3(0.0f))
        continue;
      const glm::dvec2 p = map.position(glm::dvec3(pixel_direction_[i]));
      const int column = std::min(static_cast<int>(p.x), map.width - 1);
      const int row = std::min(static_cast<int>(p.y), map.height - 1);
      texels[i] = static_cast<std::uint32_t>(row * map.width + column);
    }
  });
  return texels;
}

/// The pixel at the middle of a texel; kFill outside the field.
std::uint32_t SkyResampler::nearest_pixel(const SkyImage& sky, const SkyMap& map, std::size_t texel) const {
  const auto p = sky.pixel(
      map.direction(static_cast<double>(texel % map.width) + 0.5, static_cast<double>(texel / map.width) + 0.5));
  if (!p)
    return kFill;
  const int x = std::clamp(static_cast<int>(std::lround(p->x)), 0, image_width_ - 1);
  const int y = std::clamp(static_cast<int>(std::lround(p->y)), 0, sky.image().height - 1);
  return static_cast<std::uint32_t>(y * image_width_ + x);
}

/// Each pixel belongs to the texel that its centre falls in. A texel that pixels cover to less than kCoveredFraction
/// takes the pixel at its own middle, or the fill.
SkyResampler SkyResampler::make(const SkyImage& sky, int map_height) {
  SkyResampler r;
  r.image_width_ = sky.image().width;
  r.map_height_ = map_height;
  const SkyMap map{2 * map_height, map_height, {}};
  const std::vector<std::uint32_t> texel_of_pixel = r.find_texels(sky, map);
  const std::size_t texels = static_cast<std::size_t>(map.width) * map.height;
  std::vector<double> covered(texels, 0.0);
  std::vector<std::uint32_t> count(texels, 0);
  for (std::size_t i = 0; i < texel_of_pixel.size(); ++i)
    if (texel_of_pixel[i] != kFill) {
      covered[texel_of_pixel[i]] += static_cast<double>(sky.solid_angle_sr()[i]);
      ++count[texel_of_pixel[i]];
    }
  r.first_pixel_.assign(texels + 1, 0);
  for (std::size_t t = 0; t < texels; ++t) {
    if (covered[t] < kCoveredFraction * map.solid_angle_sr(static_cast<int>(t / map.width)))
      count[t] = 0;
    r.first_pixel_[t + 1] = r.first_pixel_[t] + std::max(count[t], 1u);
  }
  r.covering_.resize(r.first_pixel_[texels]);
  std::vector<std::uint32_t> next(r.first_pixel_.begin(), r.first_pixel_.end() - 1);
  for (std::size_t i = 0; i < texel_of_pixel.size(); ++i)
    if (const std::uint32_t t = texel_of_pixel[i]; t != kFill && count[t] > 0)
      r.covering_[next[t]++].pixel = static_cast<std::uint32_t>(i);
  for (std::size_t t = 0; t < texels; ++t)
    if (count[t] == 0)
      r.covering_[r.first_pixel_[t]].pixel = r.nearest_pixel(sky, map, t);
  r.set_fractions(sky.solid_angle_sr());
  return r;
}

/// In proportion to the pixels' solid angles.
void SkyResampler::set_fractions(const std::vector<float>& solid_angle_sr) {
  for (std::size_t t = 0; t + 1 < first_pixel_.size(); ++t) {
    const std::span<Covering> covering(&covering_[first_pixel_[t]], first_pixel_[t + 1] - first_pixel_[t]);
    float whole = 0.0f;
    for (Covering& c : covering)
      if (c.pixel != kFill)
        whole += c.fraction = std::max(solid_angle_sr[c.pixel], 1e-12f);
    for (Covering& c : covering)
      if (c.pixel != kFill)
        c.fraction /= whole;
  }
}

/// `radiance`: of a pixel.
template <class Radiance>
void SkyResampler::average(const Radiance& radiance, const SkyImage& sky, SkyMap& map) const {
  parallel_for(tbb::blocked_range<std::size_t>(0, map.radiance.size(), 4096), [&](const auto& range) {
    for (std::size_t t = range.begin(); t != range.end(); ++t) {
      Rgb sum(0.0f);
      for (std::uint32_t k = first_pixel_[t]; k != first_pixel_[t + 1]; ++k) {
        const Covering& c = covering_[k];
        if (c.pixel == kFill)
          sum = 2 * t < map.radiance.size() ? sky.sky_fill_radiance() : sky.fill_radiance();
        else
          sum += c.fraction * radiance(c.pixel);
      }
      map.radiance[t] = sum;
    }
  });
}

/// L_texel = sum over its pixels of Omega_pixel L_pixel / sum of Omega_pixel. Pixels of the sun's cluster show its
/// surround: its energy is a light of its own.
void SkyResampler::resample(const SkyImage& sky, const DetectedSun* sun, SkyMap& map) const {
  map.width = 2 * map_height_;
  map.height = map_height_;
  map.radiance.resize(first_pixel_.size() - 1);
  if (!sun)
    return average([&](std::uint32_t pixel) { return sky.image().texels[pixel]; }, sky, map);
  const float sun_cosine = static_cast<float>(std::cos(sun->cluster_radius));
  const glm::vec3 towards_sun(sun->direction);
  average(
      [&](std::uint32_t pixel) {
        return glm::dot(pixel_direction_[pixel], towards_sun) >= sun_cosine ? sun->surround : sky.image().texels[pixel];
      },
      sky, map);
}

bool is_black(const SkyMap& map) {
  return std::all_of(map.radiance.begin(), map.radiance.end(), [](const Rgb& c) { return c == Rgb(0.0f); });
}

} // namespace daylit
