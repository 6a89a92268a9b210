// What a report of an audit says in sum.

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include <glm/geometric.hpp>

#include "precompute/audit.h"
#include "precompute/detail/point_ratios.h"

namespace daylit::precompute {

namespace {
using detail::Ratio;
constexpr double kPercentile = 0.95, kFaintestSun = 0.1;
} // namespace

/// The worst of the smooth skies: the bound that a target is held against.
double AuditReport::smooth(double SkyError::*part) const {
  double worst = 0;
  for (const SkyError& s : sky)
    worst = s.is_sun ? worst : std::max(worst, s.*part);
  return worst;
}

/// Root of the mean square over the suns: where they stand is chance.
double AuditReport::sun(double SkyError::*part) const {
  double sum = 0;
  int suns = 0;
  for (const SkyError& s : sky)
    if (s.is_sun && !s.of_room) {
      sum += (s.*part) * (s.*part);
      ++suns;
    }
  return suns > 0 ? std::sqrt(sum / suns) : 0.0;
}

/// Percentile at 0.95 (n - 1) of the sorted errors.
ErrorSpread ErrorSpread::of(std::vector<double> errors) {
  if (errors.empty())
    return {};
  std::ranges::sort(errors);
  const double at = kPercentile * static_cast<double>(errors.size() - 1), below = std::floor(at);
  const auto i = static_cast<std::size_t>(below);
  return {errors.size(), std::accumulate(errors.begin(), errors.end(), 0.0) / static_cast<double>(errors.size()),
          std::lerp(errors[i], errors[std::min(i + 1, errors.size() - 1)], at - below), errors.back()};
}

RoomErrors AuditReport::errors_in(std::size_t room, double mesh) const {
  double brightest = 0;
  for (const SkyError& s : sky)
    brightest = std::max(brightest, s.is_sun ? s.rooms[room].light : 0.0);
  std::vector<double> smooth, sun;
  for (const SkyError& s : sky)
    if (!s.is_sun || (s.rooms[room].light > 0 && s.rooms[room].light >= kFaintestSun * brightest))
      (s.is_sun ? sun : smooth).push_back(std::hypot(s.rooms[room].error, mesh));
  return {ErrorSpread::of(std::move(smooth)), ErrorSpread::of(std::move(sun))};
}

/// nrms difference of the direct transports at the points that both have, worst of the smooth skies.
double mesh_difference(const AuditReport& coarse, const AuditReport& fine) {
  // Points outside one of the two grids are in one list only; the order is the same.
  std::vector<std::array<std::size_t, 2>> common;
  for (std::size_t i = 0, j = 0; i < coarse.points.size() && j < fine.points.size();) {
    const glm::dvec3 &a = coarse.points[i], &b = fine.points[j];
    if (glm::length(a - b) <= 1e-9 * (glm::length(a) + glm::length(b)))
      common.push_back({i++, j++});
    else if (coarse.points.size() - i > fine.points.size() - j)
      ++i;
    else
      ++j;
  }
  double worst = 0;
  for (std::size_t s = 0; s < fine.sky.size() && !fine.sky[s].is_sun; ++s) {
    Ratio r;
    for (const auto& [i, j] : common)
      for (std::size_t k = 0; k < 27; ++k)
        r.add(static_cast<double>(coarse.exact[(s * coarse.points.size() + i) * 27 + k]),
              static_cast<double>(fine.exact[(s * fine.points.size() + j) * 27 + k]));
    worst = std::max(worst, r.nrms());
  }
  return worst;
}

} // namespace daylit::precompute
