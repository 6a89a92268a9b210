#pragma once

// The distant light that paths end in: an analytic sky with its sun as a light of its own, or a sky image whose small
// bright spots (a sun, its surroundings) can be sampled. Immutable, shared by threads.

#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "scene/sky/sky_image.h"
#include "scene/sky/sky_model.h"

namespace daylit {

struct SpotSample {
  glm::vec3 direction{0.0f};
  float density = 0.0f; ///< per sr
};

class SkyLight {
public:
  explicit SkyLight(const SkyModel& model);
  explicit SkyLight(std::shared_ptr<const SkyImage> image);

  /// Everything but sun().
  Rgb radiance(const glm::vec3& unit_direction) const;
  /// The sun of an analytic sky. An image keeps its sun in radiance().
  const std::optional<SunDisc>& sun() const { return sun_; }

  /// Texels brighter than kSpotContrast times the mean, chosen by their power. None in an even sky.
  bool has_spots() const { return !spot_texel_.empty(); }
  std::optional<SpotSample> sample_spot(const glm::vec2& u) const;
  float spot_density(const glm::vec3& unit_direction) const;

  static constexpr float kSpotContrast = 8.0f;

private:
  std::variant<AnalyticSky, std::shared_ptr<const SkyImage>> source_;
  std::optional<SunDisc> sun_;
  std::vector<std::uint32_t> spot_texel_;
  std::vector<double> spot_cdf_;     ///< cumulative power, last = 1
  std::vector<float> texel_density_; ///< per texel, per sr; empty when there is no spot
};

} // namespace daylit
