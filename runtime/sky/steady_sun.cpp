#include "runtime/sky/steady_sun.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

namespace daylit {

namespace {

constexpr std::size_t kNoisePixels = 4096;
constexpr double kMostNoise = 0.02;         // above it clouds move: no sensor is that bad on a bright sky
constexpr double kMedianDeviation = 0.9539; // median of |a - b| by the deviation of a and b: 0.6745 sqrt 2
constexpr int kMostFrames = 64;
constexpr double kThreshold = 4.0; // standard deviations
// Mean of the deviations with weight 1/4 for the newest: its own deviation is sqrt(w / (2 - w)) of one's.
constexpr double kDriftWeight = 0.25, kDriftThreshold = kThreshold * 0.378;
constexpr float kMovedFraction = 0.1f; // of the sun's radius

} // namespace

/// Relative deviation of a pixel, from the median of |a - b| / ((a + b) / 2) over pixels of two frames: robust against
/// what really moved. For normal noise of deviation s the median of |a - b| is 0.6745 sqrt(2) s.
void SteadySun::measure_noise(const SkyImage& sky) {
  const std::vector<Rgb>& texels = sky.image().texels;
  const std::size_t stride = std::max<std::size_t>(texels.size() / kNoisePixels, 1);
  const bool known = !last_pixels_.empty() && width_ == sky.image().width && height_ == sky.image().height;
  std::vector<double> relative;
  std::vector<float> pixels;
  for (std::size_t i = 0, k = 0; i < texels.size(); i += stride, ++k) {
    pixels.push_back(texels[i].g);
    if (known && texels[i].g > 0.0f && last_pixels_[k] > 0.0f)
      relative.push_back(2.0 * std::fabs(static_cast<double>(texels[i].g - last_pixels_[k])) /
                         static_cast<double>(texels[i].g + last_pixels_[k]));
  }
  last_pixels_ = std::move(pixels);
  width_ = sky.image().width;
  height_ = sky.image().height;
  pixel_noise_ = 0.0;
  if (relative.empty())
    return;
  const auto middle = relative.begin() + static_cast<std::ptrdiff_t>(relative.size() / 2);
  std::nth_element(relative.begin(), middle, relative.end());
  pixel_noise_ = std::min(*middle / kMedianDeviation, kMostNoise);
}

/// The deviation of this frame's energy from the mean of n frames is s sqrt(1 + 1 / n), with s = pixel noise x noise
/// fraction of the cluster. New: beyond kThreshold of these, or when the mean of the deviations, with exponential
/// weights, is beyond kThreshold of its own.
bool SteadySun::is_new(const DetectedSun& sun) {
  if (!mean_ || pixel_noise_ <= 0.0 ||
      glm::length(sun.direction - mean_->direction) > static_cast<double>(kMovedFraction) * kSunAngularRadius)
    return true;
  const double expected = static_cast<double>(luminance(mean_->normal_irradiance));
  const double sigma = expected * pixel_noise_ * sun.noise_fraction * std::sqrt(1.0 + 1.0 / count_);
  const double deviation = (static_cast<double>(luminance(sun.normal_irradiance)) - expected) / sigma;
  drift_ += kDriftWeight * (deviation - drift_);
  return !(std::fabs(deviation) <= kThreshold && std::fabs(drift_) <= kDriftThreshold);
}

/// Running mean: m_n = m_(n-1) + (x_n - m_(n-1)) / n, of energy and direction.
std::optional<DetectedSun> SteadySun::update(const SkyImage& sky, const std::optional<DetectedSun>& sun) {
  measure_noise(sky);
  if (!sun) {
    mean_.reset();
    count_ = 0;
    return std::nullopt;
  }
  if (is_new(*sun)) {
    mean_ = sun;
    count_ = 1;
    drift_ = 0.0;
    return sun;
  }
  count_ = std::min(count_ + 1, kMostFrames);
  const double fraction = 1.0 / count_;
  DetectedSun steady = *sun; // its cluster is this frame's: those pixels are replaced
  steady.normal_irradiance =
      mean_->normal_irradiance + static_cast<float>(fraction) * (sun->normal_irradiance - mean_->normal_irradiance);
  steady.direction = glm::normalize(mean_->direction + fraction * (sun->direction - mean_->direction));
  mean_ = steady;
  return steady;
}

/// Adds E / Omega to a region, or to the nodes around in proportion to their weights: sum of L Omega grows by E.
void add_distant_light(const SkyPartition& partition, const glm::dvec3& direction, const Rgb& irradiance,
                       std::vector<Rgb>& regions) {
  if (!partition.interpolated()) {
    const int region = partition.region_of(direction);
    regions[region] += irradiance / static_cast<float>(partition.solid_angle_sr(region));
    return;
  }
  for (const RegionWeight& w : partition.interpolation(direction))
    regions[w.region] += irradiance * static_cast<float>(w.weight / partition.solid_angle_sr(w.region));
}

} // namespace daylit
