#include "bench/volume_error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "precompute/audit.h"

namespace daylit::bench {

namespace {

using Json = nlohmann::json;

constexpr double kLitBySun = 0.2; ///< of the light of the brightest sun and its sky: half of it the sky's

/// Error and power of the light in one place under one sky.
struct Sums {
  double error2 = 0, power2 = 0, noise2 = 0;
  int unknown = 0; ///< points where the volume has no light
  /// nrms, the noise of the reference taken out of it.
  double nrms() const { return power2 > 0 ? std::sqrt(std::max(0.0, error2 - noise2) / power2) : 0.0; }
  double noise() const { return power2 > 0 ? std::sqrt(noise2 / power2) : 0.0; }
};

double square(const Rgb& c) { return static_cast<double>(glm::dot(c, c)); }

Sums compare(const IndirectLight& indirect, const std::vector<glm::dvec3>& points,
             std::span<const IrradianceEstimate> truth) {
  Sums sums;
  for (std::size_t p = 0; p < points.size(); ++p) {
    const auto light = indirect.at(points[p]);
    sums.unknown += light ? 0 : 1;
    for (std::size_t k = 0; k < 6; ++k) {
      glm::vec3 normal(0.0f);
      normal[static_cast<int>(k / 2)] = k % 2 == 0 ? 1.0f : -1.0f;
      const IrradianceEstimate& e = truth[6 * p + k];
      sums.error2 += square((light ? irradiance(*light, normal) : Rgb(0.0f)) - e.value);
      sums.noise2 += square(e.standard_error);
      sums.power2 += square(e.value);
    }
  }
  return sums;
}

/// The largest of fewer than twenty.
double percentile95_of_all(const std::vector<Sums>& suns) {
  std::vector<double> errors;
  for (const Sums& sun : suns)
    errors.push_back(sun.nrms());
  std::ranges::sort(errors);
  const auto at = static_cast<std::size_t>(0.95 * static_cast<double>(errors.size()));
  return errors.empty() ? 0.0 : errors[std::min(errors.size() - 1, at)];
}

/// Of the suns under which the place has at least kLitBySun of the light that the brightest one gives it. Elsewhere its
/// light is that of the sky around the sun.
double percentile95_looking_in(const std::vector<Sums>& suns) {
  double brightest2 = 0;
  for (const Sums& sun : suns)
    brightest2 = std::max(brightest2, sun.power2);
  std::vector<double> errors;
  for (const Sums& sun : suns)
    if (sun.power2 >= kLitBySun * kLitBySun * brightest2)
      errors.push_back(sun.nrms());
  return precompute::ErrorSpread::of(std::move(errors)).percentile95;
}

} // namespace

Result<std::vector<IndirectLight>> lights_under(const std::vector<RoomTruth>& truth, const BasisVolume& volume,
                                                const RayScene& scene) {
  std::vector<IndirectLight> lights;
  for (const RoomTruth& t : truth) {
    auto light = IndirectLight::make(volume, scene, t.sky.sky);
    if (!light)
      return light.error();
    lights.push_back(std::move(*light));
  }
  return lights;
}

int room_of(const Json& claimed, const glm::dvec3& point) {
  double smallest = std::numeric_limits<double>::infinity();
  int found = -1, number = 0;
  for (const Json& room : claimed.value("rooms", Json::array())) {
    const auto low = room["low_m"].get<std::array<double, 3>>(), high = room["high_m"].get<std::array<double, 3>>();
    double size = 1.0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double x = point[static_cast<int>(k)];
      size *= x >= low[k] && x <= high[k] ? high[k] - low[k] : std::numeric_limits<double>::infinity();
    }
    if (size < smallest) {
      smallest = size;
      found = number;
    }
    ++number;
  }
  return found;
}

Json place_error(const std::vector<glm::dvec3>& points, std::size_t first, const std::vector<RoomTruth>& truth,
                 const std::vector<IndirectLight>& lights, const Json& claimed) {
  const std::size_t count = 6 * points.size();
  double smooth = 0, noise = 0;
  std::vector<Sums> suns;
  Json row = {{"skies", Json::array()}, {"unknown_points", 0}, {"smooth_claimed", 0.0}, {"sun_claimed", 0.0}};
  for (std::size_t s = 0; s < truth.size(); ++s) {
    const BenchSky& sky = truth[s].sky;
    const Sums sums = compare(lights[s], points, std::span(truth[s].irradiance).subspan(6 * first, count));
    if (sky.small_sun)
      suns.push_back(sums);
    else
      smooth = std::max(smooth, sums.nrms());
    row["skies"].push_back({{"sky", sky.name},
                            {"small_sun", sky.small_sun},
                            {"error", sums.nrms()},
                            {"noise", sums.noise()},
                            {"light", std::sqrt(sums.power2 / static_cast<double>(3 * count))}});
    row["unknown_points"] = sums.unknown;
    noise = std::max(noise, sums.noise());
  }
  row["smooth"] = smooth;
  row["noise"] = noise;
  row["sun"] = percentile95_of_all(suns);
  row["sun_looking_in"] = percentile95_looking_in(suns);
  if (const int room = room_of(claimed, points.front()); room >= 0)
    for (const auto& [key, skies] : {std::pair{"smooth_claimed", "smooth"}, {"sun_claimed", "sun"}})
      row[key] = claimed["rooms"][static_cast<std::size_t>(room)][skies]["percentile_95"];
  return row;
}

} // namespace daylit::bench
