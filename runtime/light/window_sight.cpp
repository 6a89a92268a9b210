#include "runtime/light/window_sight.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/geometric.hpp>

#include "scene/aperture.h"

namespace daylit {

namespace {
constexpr int kWindowPoints = 4; ///< per side
constexpr int kSunSamples = 8;
} // namespace

void WindowSight::set_sun(const std::optional<DetectedSun>& detected) {
  sun_.clear();
  sun_normal_irradiance_ = detected ? detected->normal_irradiance : Rgb(0.0f);
  for (int k = 0; detected && k < kSunSamples; ++k)
    sun_.push_back(sun_disc_direction(detected->direction, k, kSunSamples));
}

/// Share of the windows' points, given by their offset from x, that count; `none` where no window faces x.
template <class Counts>
double WindowSight::share_of_windows(const glm::dvec3& x, const glm::dvec3& n, double none, Counts counts) const {
  double seen = 0.0, all = 0.0;
  for (const Aperture& a : apertures_)
    for (int i = 0; i < kWindowPoints; ++i)
      for (int j = 0; j < kWindowPoints; ++j) {
        const std::size_t last = a.corners.size() - 1;
        const double s = (i + 0.5) / kWindowPoints, t = (j + 0.5) / kWindowPoints;
        const glm::dvec3 p = (1 - s) * ((1 - t) * a.corners[0] + t * a.corners[last]) +
                             s * ((1 - t) * a.corners[1] + t * a.corners[std::min<std::size_t>(2, last)]);
        const glm::dvec3 d = p - x;
        const double r2 = glm::dot(d, d), weight = -glm::dot(a.inward, d) * glm::dot(n, d) / (r2 * r2);
        if (glm::dot(n, d) <= 0.0 || glm::dot(a.inward, d) >= 0.0)
          continue;
        all += weight;
        if (counts(d))
          seen += weight;
      }
  return all > 0.0 ? seen / all : none;
}

float WindowSight::window_share(const glm::dvec3& x, const glm::dvec3& n) const {
  const glm::vec3 from = rays_.to_local(x);
  return static_cast<float>(share_of_windows(
      x, n, 1.0, [&](const glm::dvec3& d) { return !rays_.occluded(from, glm::vec3(d), 0.0f, 0.9999f); }));
}

float WindowSight::lost_share(const glm::dvec3& x, const glm::dvec3& n, const PlacedParts& parts) const {
  const glm::vec3 from = rays_.to_local(x);
  return static_cast<float>(share_of_windows(x, n, 0.0, [&](const glm::dvec3& d) {
    return parts.covered(x, glm::normalize(d)) && !rays_.occluded(from, glm::vec3(d), 0.0f, 0.9999f);
  }));
}

Rgb WindowSight::sun_sample(std::size_t number, const glm::dvec3& x, const glm::dvec3& n) const {
  if (sun_.empty())
    return Rgb(0.0f);
  const glm::dvec3 direction = sun_[number % sun_.size()];
  const double cosine = glm::dot(n, direction);
  if (cosine <= 0.0)
    return Rgb(0.0f);
  constexpr double kFar = std::numeric_limits<double>::infinity();
  int crossed = 0;
  const Rgb pane = aperture_transmittance(apertures_, x, direction, kFar, &crossed);
  if (crossed == 0 || rays_.occluded(rays_.to_local(x), glm::vec3(direction), 0.0f, static_cast<float>(kFar)))
    return Rgb(0.0f);
  return static_cast<float>(cosine) * pane * sun_normal_irradiance_;
}

Rgb WindowSight::sun(const glm::dvec3& x, const glm::dvec3& n) const {
  Rgb sum(0.0f);
  for (std::size_t k = 0; k < sun_.size(); ++k)
    sum += sun_sample(k, x, n);
  return sun_.empty() ? sum : sum / static_cast<float>(sun_.size());
}

Rgb WindowSight::lost_sun(const glm::dvec3& x, const glm::dvec3& n, const PlacedParts& parts) const {
  const Rgb arrives = sun_sample(sun_.size() / 2, x, n);
  return arrives != Rgb(0.0f) && parts.covered(x, sun_direction()) ? arrives : Rgb(0.0f);
}

} // namespace daylit
