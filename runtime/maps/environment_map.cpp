#include "runtime/maps/environment_map.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>
#include <numeric>

#include "scene/core/parallel.h"

namespace daylit {

double phong_exponent(double roughness) {
  const double alpha = roughness * roughness;
  return std::clamp((2.0 / (alpha * alpha) - 2.0) / 4.0, 1.0, kMaxExponent);
}

double ggx_roughness(double exponent) { return std::pow(2.0 / (4.0 * exponent + 2.0), 0.25); }

int side_of_lobe(double exponent, int most) {
  int side = 8;
  while (side < most && side < 2.0 * std::sqrt(4.0 * std::numbers::pi * exponent))
    side *= 2;
  return std::min(side, most);
}

Result<EnvironmentMap> EnvironmentMap::create(const Settings& settings) {
  constexpr const char* where = "EnvironmentMap";
  EnvironmentMap map;
  map.settings_ = settings;
  for (const double roughness : settings.roughness) {
    if (!(roughness > 0.0 && roughness <= 1.0))
      return Error{ErrorCode::value_invalid, "a roughness of " + std::to_string(roughness), where, "use 0 to 1"};
    const double exponent = phong_exponent(roughness);
    if (!map.lobes_.empty() && exponent >= map.lobes_.back().exponent)
      return Error{ErrorCode::value_invalid, "roughness does not ascend to one lobe each", where,
                   "list it in ascending order, and at most one above 0.76"};
    map.lobes_.push_back({exponent, side_of_lobe(exponent, settings.side)});
  }
  map.sharp_ = RadianceMap(std::clamp(settings.side, 0, kMaxMapSide));
  if (const auto ok = check_map(map.sharp_, where); !ok)
    return ok.error();
  for (const Lobe& lobe : map.lobes_)
    map.blurred_.emplace_back(lobe.side);
  return map;
}

Result<std::size_t> EnvironmentMap::update(const Radiance& radiance, std::stop_token stop) {
  std::vector<std::uint32_t> all(sharp_.radiance.size());
  std::iota(all.begin(), all.end(), 0u);
  return update(radiance, all, std::move(stop));
}

Result<std::size_t> EnvironmentMap::update(const Radiance& radiance, std::span<const std::uint32_t> texels,
                                           std::stop_token stop) {
  constexpr const char* where = "EnvironmentMap::update";
  RadianceMap next = sharp_;
  std::atomic<std::size_t> changed{0};
  for (const std::uint32_t t : texels)
    if (t >= next.radiance.size())
      return Error{ErrorCode::value_invalid, "there is no texel " + std::to_string(t), where, ""};
  parallel_for(tbb::blocked_range<std::size_t>(0, texels.size(), 256), [&](const auto& range) {
    for (std::size_t i = range.begin(); i != range.end() && !stop.stop_requested(); ++i) {
      Rgb& texel = next.radiance[texels[i]];
      const Rgb now = radiance(glm::vec3(next.direction(texels[i])));
      changed += now != texel ? 1 : 0;
      texel = now;
    }
  });
  if (stop.stop_requested())
    return Error{ErrorCode::interrupted, "stopped", where, ""};
  if (changed == 0)
    return std::size_t(0);
  auto blurred = prefilter(next, lobes_, settings_.method, {settings_.tolerance, stop, {}});
  if (!blurred)
    return blurred.error();
  sharp_ = std::move(next);
  blurred_ = std::move(*blurred);
  return changed.load();
}

Rgb EnvironmentMap::lookup(const glm::vec3& direction, double exponent) const {
  const double width = 1.0 / std::sqrt(exponent);
  std::size_t wider = 0; // first level that is at least as wide
  while (wider < lobes_.size() && 1.0 / std::sqrt(lobes_[wider].exponent) < width)
    ++wider;
  if (wider == lobes_.size())
    return (lobes_.empty() ? sharp_ : blurred_.back()).lookup(direction);
  const double above = 1.0 / std::sqrt(lobes_[wider].exponent);
  const double below = wider == 0 ? 0.0 : 1.0 / std::sqrt(lobes_[wider - 1].exponent);
  const float part = static_cast<float>((width - below) / (above - below));
  const RadianceMap& narrow = wider == 0 ? sharp_ : blurred_[wider - 1];
  return (1.0f - part) * narrow.lookup(direction) + part * blurred_[wider].lookup(direction);
}

} // namespace daylit
