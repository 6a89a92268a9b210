#include "precompute/probe_density.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "precompute/probes.h"
#include "scene/volume/probe_planes.h"

namespace daylit::precompute {

namespace {

constexpr double kExponent = 0.07;
constexpr double kThinnest = 0.5;      ///< of the mean density
constexpr double kLongStep = 0.3;      ///< so much longer than planned may a step be that ends at a fixed plane
constexpr double kFaintest2 = 0.01;    ///< of the brightest region's squared light: what fainter ones count against
constexpr double kBelowHorizon2 = 0.1; ///< no sun stands there

/// Weight of each stored region: 1 / its squared light, so that every sun counts the same, with a floor for faint ones.
std::vector<double> region_weights(const BasisVolume& volume) {
  const std::size_t row = volume.row_floats();
  std::vector<double> power;
  for (std::size_t r = 0; r < volume.stored_region.size(); ++r)
    power.push_back(std::transform_reduce(volume.basis.begin() + std::ptrdiff_t(r * row),
                                          volume.basis.begin() + std::ptrdiff_t((r + 1) * row), 0.0, std::plus<>{},
                                          [](float x) { return double(x) * double(x); }));
  const double most = power.empty() ? 0.0 : *std::ranges::max_element(power);
  std::vector<double> weight;
  for (std::size_t r = 0; r < power.size(); ++r)
    weight.push_back((volume.partition.centre(volume.stored_region[r]).z > 0.0 ? 1.0 : kBelowHorizon2) /
                     std::max({power[r], kFaintest2 * most, 1e-300}));
  return weight;
}

/// Probes a, b, c in a row, and the distances between them.
struct Row {
  std::size_t a, b, c;
  double to_a, to_c;
};

/// sum_r w_r |L''|^2 over the 27 coefficients, L'' = 2 ((L_c - L_b) / h_c - (L_b - L_a) / h_a) / (h_a + h_c): what
/// linear interpolation misses.
double curvature2(const BasisVolume& volume, const std::vector<double>& weight, const Row& at) {
  double sum = 0;
  for (std::size_t r = 0; r < weight.size(); ++r) {
    const float* row = volume.basis.data() + r * volume.row_floats();
    double of_region = 0;
    for (std::size_t k = 0; k < 27; ++k) {
      const double b = static_cast<double>(row[27 * at.b + k]);
      const double d = 2.0 *
                       ((static_cast<double>(row[27 * at.c + k]) - b) / at.to_c -
                        (b - static_cast<double>(row[27 * at.a + k])) / at.to_a) /
                       (at.to_a + at.to_c);
      of_region += d * d;
    }
    sum += weight[r] * of_region;
  }
  return sum;
}

/// A plane of which nothing is known, since no probe of it has neighbours on both sides, takes what is known beside it:
/// the last one before a wall, or of the grid.
std::vector<double> beside_walls(const std::vector<double>& known) {
  std::vector<double> all = known;
  for (std::size_t i = 0; i < known.size(); ++i)
    if (!(known[i] > 0.0))
      all[i] = std::max(i > 0 ? known[i - 1] : 0.0, i + 1 < known.size() ? known[i + 1] : 0.0);
  return all;
}

/// Values at uneven, increasing places as values at as many equal steps from the first to the last.
std::vector<double> at_equal_steps(const std::vector<double>& place, const std::vector<double>& value) {
  std::vector<double> out;
  std::size_t i = 0;
  for (std::size_t k = 0; k < place.size(); ++k) {
    const double x = std::lerp(place.front(), place.back(), static_cast<double>(k) / double(place.size() - 1));
    while (i + 2 < place.size() && place[i + 1] < x)
      ++i;
    out.push_back(std::lerp(value[i], value[i + 1], std::clamp((x - place[i]) / (place[i + 1] - place[i]), 0.0, 1.0)));
  }
  return out;
}

} // namespace

/// Density of planes along each axis ~ g^kExponent, g the squared curvatures summed across the axis (probe_density.h).
Result<ProbeDensity> probe_density(const BasisVolume& coarse) {
  const ProbeSet& probes = coarse.probes;
  ProbeDensity density;
  if (!probes.is_grid || coarse.stored_region.empty())
    return density;
  const auto scene = RayScene::build(coarse.room);
  if (!scene)
    return scene.error();
  const auto open = [&](std::size_t a, std::size_t b) {
    const auto at = [&](std::size_t i) { return probes.origin + glm::dvec3(probes.positions[i]); };
    return probes.valid[a] && probes.valid[b] && open_between(at(a), at(b), *scene, coarse.apertures);
  };
  const std::vector<double> weight = region_weights(coarse);
  const ProbePlanes planes(probes);
  std::size_t stride = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const auto count = static_cast<std::size_t>(probes.count[axis]);
    const std::vector<double>& place = planes.along(axis);
    std::vector<double> g(count, 0.0);
    for (std::size_t i = 0; i < probes.size(); ++i)
      if (const std::size_t at = i / stride % count;
          at > 0 && at + 1 < count && open(i - stride, i) && open(i, i + stride))
        g[at] += curvature2(coarse, weight,
                            {i - stride, i, i + stride, place[at] - place[at - 1], place[at + 1] - place[at]});
    stride *= count;
    if (count < 3 || !(*std::ranges::max_element(g) > 0.0))
      continue; // nothing is known: regular along this axis
    for (const double x : at_equal_steps(place, beside_walls(g)))
      density[static_cast<std::size_t>(axis)].push_back(std::pow(x, kExponent));
  }
  return density;
}

namespace {

/// Integral of the piecewise linear density from the first plane on, in units of its mean.
class DensityIntegral {
public:
  explicit DensityIntegral(const std::vector<double>& density)
      : value_(density.empty() ? std::vector<double>(2, 1.0) : density) {
    const double mean = std::accumulate(value_.begin(), value_.end(), 0.0) / static_cast<double>(value_.size());
    for (std::size_t i = 0; i < value_.size(); ++i) {
      value_[i] = std::max(value_[i], kThinnest * mean);
      if (i > 0)
        before_.push_back(before_.back() + 0.5 * (value_[i - 1] + value_[i]));
    }
  }

  double whole() const { return before_.back(); }

  /// At a part 0..1 of the way: sum of the steps before and a t + (b - a) t^2 / 2 of its own.
  double at(double way) const {
    const double x = std::clamp(way, 0.0, 1.0) * steps();
    const std::size_t step = std::min(static_cast<std::size_t>(x), value_.size() - 2);
    const double t = x - static_cast<double>(step);
    return before_[step] + t * (value_[step] + 0.5 * t * (value_[step + 1] - value_[step]));
  }

  /// The part of the way at which the integral is `wanted`: a t + (b - a) t^2 / 2 = rest, in the form that keeps its
  /// digits.
  double way_of(double wanted) const {
    std::size_t step = 0;
    while (step + 2 < value_.size() && before_[step + 1] <= wanted)
      ++step;
    const double a = value_[step], rise = value_[step + 1] - a, rest = wanted - before_[step];
    const double t = 2.0 * rest / (a + std::sqrt(std::max(a * a + 2.0 * rise * rest, 0.0)));
    return (static_cast<double>(step) + t) / steps();
  }

private:
  double steps() const { return static_cast<double>(value_.size() - 1); }
  std::vector<double> value_, before_{0.0};
};

} // namespace

/// Between two fixed planes, or ends, with n steps' worth of density between them: ceil(n - 0.3) equal parts.
std::vector<double> planes_of(const std::vector<double>& density, int count, double first, double last,
                              const std::vector<double>& fixed) {
  const DensityIntegral integral(density);
  const double per_step = integral.whole() / std::max(count - 1, 1);
  std::vector<double> planes{first}, ends = fixed;
  ends.push_back(last);
  for (const double end : ends) {
    const double begin = planes.back();
    const double from = integral.at((begin - first) / (last - first)), to = integral.at((end - first) / (last - first));
    const int parts = std::max(1, static_cast<int>(std::ceil((to - from) / per_step - kLongStep)));
    for (int k = 1; k < parts; ++k)
      planes.push_back(first + (last - first) * integral.way_of(from + (to - from) * k / parts));
    planes.push_back(end);
  }
  return planes;
}

} // namespace daylit::precompute
