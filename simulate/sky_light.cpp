#include <algorithm>
#include <cmath>
#include <utility>

#include <glm/geometric.hpp>

#include "simulate/trace_scene.h"

namespace daylit {

namespace {

const AnalyticSky black_sky() {
  SkyModel model;
  model.zenith_radiance = Rgb(0.0f);
  return AnalyticSky(model);
}

} // namespace

SkyLight::SkyLight(const SkyModel& model) : source_(AnalyticSky(model)), sun_(model.sun) {
  if (sun_ && sun_->normal_irradiance == Rgb(0.0f))
    sun_.reset();
}

SkyLight::SkyLight(std::shared_ptr<const SkyImage> image) : source_(black_sky()) {
  const SkyImage& sky = *image;
  const std::vector<float>& solid_angle = sky.solid_angle_sr();
  double power = 0.0, total = 0.0;
  for (std::size_t i = 0; i < solid_angle.size(); ++i) {
    power += static_cast<double>(luminance(sky.image().texels[i])) * static_cast<double>(solid_angle[i]);
    total += static_cast<double>(solid_angle[i]);
  }
  const float threshold = total > 0.0 ? kSpotContrast * static_cast<float>(power / total) : 0.0f;
  double spot_power = 0.0;
  for (std::size_t i = 0; i < solid_angle.size(); ++i)
    if (solid_angle[i] > 0.0f && luminance(sky.image().texels[i]) > threshold) {
      spot_texel_.push_back(static_cast<std::uint32_t>(i));
      spot_power += static_cast<double>(luminance(sky.image().texels[i])) * static_cast<double>(solid_angle[i]);
      spot_cdf_.push_back(spot_power);
    }
  if (!spot_texel_.empty())
    texel_density_.assign(solid_angle.size(), 0.0f);
  for (std::size_t k = 0; k < spot_texel_.size(); ++k) {
    spot_cdf_[k] /= spot_power;
    texel_density_[spot_texel_[k]] =
        static_cast<float>(static_cast<double>(luminance(sky.image().texels[spot_texel_[k]])) / spot_power);
  }
  source_ = std::move(image);
}

Rgb SkyLight::radiance(const glm::vec3& d) const {
  const glm::dvec3 direction = glm::normalize(glm::dvec3(d));
  if (const auto* analytic = std::get_if<AnalyticSky>(&source_))
    return analytic->sky_radiance(direction);
  return std::get<std::shared_ptr<const SkyImage>>(source_)->radiance(direction);
}

std::optional<SpotSample> SkyLight::sample_spot(const glm::vec2& u) const {
  if (spot_texel_.empty())
    return std::nullopt;
  const double target = static_cast<double>(u.x);
  const auto at = std::upper_bound(spot_cdf_.begin(), spot_cdf_.end() - 1, target);
  const std::size_t k = static_cast<std::size_t>(at - spot_cdf_.begin());
  const double low = k == 0 ? 0.0 : spot_cdf_[k - 1];
  const double stretched = std::clamp((target - low) / (spot_cdf_[k] - low), 0.0, 1.0 - 0x1p-24);
  const SkyImage& sky = *std::get<std::shared_ptr<const SkyImage>>(source_);
  const int width = sky.image().width;
  const int x = static_cast<int>(spot_texel_[k]) % width, y = static_cast<int>(spot_texel_[k]) / width;
  // Uniform in the texel's area instead of its solid angle: within one texel these differ by its angular size squared.
  const auto direction = sky.direction({x - 0.5 + stretched, y - 0.5 + static_cast<double>(u.y)});
  if (!direction)
    return std::nullopt;
  return SpotSample{glm::vec3(*direction), texel_density_[spot_texel_[k]]};
}

float SkyLight::spot_density(const glm::vec3& d) const {
  if (spot_texel_.empty())
    return 0.0f;
  const SkyImage& sky = *std::get<std::shared_ptr<const SkyImage>>(source_);
  const auto pixel = sky.pixel(glm::normalize(glm::dvec3(d)));
  if (!pixel)
    return 0.0f;
  const int width = sky.image().width, height = sky.image().height;
  const int x = std::clamp(static_cast<int>(std::floor(pixel->x + 0.5)), 0, width - 1);
  const int y = std::clamp(static_cast<int>(std::floor(pixel->y + 0.5)), 0, height - 1);
  return texel_density_[static_cast<std::size_t>(y) * width + x];
}

} // namespace daylit
