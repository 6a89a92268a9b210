#include "capture/hdr/lost_sun.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

namespace daylit {

namespace {

constexpr double kSunCone = 4.0 * std::numbers::pi / 180; ///< glare, and the error of the lens's orientation
constexpr float kLeastDiffuse = 0.165f;

glm::dvec2 pixel_of(const SkyGeometry& geometry, std::size_t texel) {
  const auto width = static_cast<std::size_t>(geometry.width());
  return {texel % width, texel / width};
}

} // namespace

std::optional<Rgb> SkyBalance::irradiance_at_most() const {
  if (unexplained > 0 && !sun_restored)
    return std::nullopt;
  return sun_lost && !sun_restored ? irradiance / kLeastDiffuse : irradiance;
}

std::optional<LostSun> lost_sun(const SkyGeometry& geometry, const std::vector<std::uint8_t>& over_range,
                                const std::optional<glm::dvec3>& expected) {
  std::vector<glm::dvec3> found;
  glm::dvec3 sum(0.0);
  for (std::size_t i = 0; i < over_range.size(); ++i)
    if (over_range[i])
      if (const auto direction = geometry.direction(pixel_of(geometry, i))) {
        found.push_back(*direction);
        sum += *direction;
      }
  if (found.empty() || (!expected && !(glm::length(sum) > 0)))
    return std::nullopt;
  const glm::dvec3 sun = expected ? *expected : glm::normalize(sum);
  const auto near = [&](const glm::dvec3& d) { return glm::dot(d, sun) > std::cos(kSunCone); };
  const auto pixels = static_cast<std::size_t>(std::ranges::count_if(found, near));
  const bool is_sun = expected ? pixels > 0 : pixels == found.size();
  return is_sun ? std::optional(LostSun{sun, pixels}) : std::nullopt;
}

// E = pi sum(L cos Z dOmega) / sum(cos Z dOmega), as in SkyImage: a pixel's share w of the missing illuminance is the
// radiance w E_missing W / (pi cos Z dOmega) in it, W = sum(cos Z dOmega).
bool restore_sun(RgbImage& radiance, const SkyGeometry& geometry, const glm::dvec3& direction, double illuminance) {
  const std::vector<float>& projected = geometry.projected_solid_angle_sr();
  const auto at = geometry.pixel(direction);
  if (!at || projected.size() != radiance.texels.size())
    return false;
  double whole = 0, measured = 0;
  for (std::size_t i = 0; i < projected.size(); ++i) {
    whole += double(projected[i]);
    measured += double(projected[i] * luminance(radiance.texels[i]));
  }
  const glm::dvec2 corner = glm::floor(*at), part = *at - corner;
  std::array<std::pair<std::size_t, double>, 4> shares{};
  for (int k = 0; k < 4; ++k) {
    const int dx = k % 2, dy = k / 2;
    const int x = static_cast<int>(corner.x) + dx, y = static_cast<int>(corner.y) + dy;
    if (x < 0 || y < 0 || x >= radiance.width || y >= radiance.height)
      return false;
    const std::size_t i = static_cast<std::size_t>(y) * static_cast<std::size_t>(radiance.width) + std::size_t(x);
    if (!(projected[i] > 0))
      return false;
    shares[static_cast<std::size_t>(k)] = {i, (dx ? part.x : 1 - part.x) * (dy ? part.y : 1 - part.y)};
  }
  const double missing = illuminance * whole / std::numbers::pi - measured;
  for (const auto& [i, share] : shares)
    radiance.texels[i] += static_cast<float>(std::max(missing, 0.0) * share / double(projected[i]));
  return true;
}

Rgb horizontal_irradiance(const SkyImage& sky) { return std::numbers::pi_v<float> * sky.sky_fill_radiance(); }

} // namespace daylit
