#include "precompute/probe_density.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "precompute/probes.h"

namespace daylit::precompute {

namespace {

constexpr double kExponent = 0.07;
constexpr double kThinnest = 0.5;      ///< of the mean density
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

/// sum_r w_r |L_a - 2 L_b + L_c|^2 over the 27 coefficients: squared second difference, what linear interpolation
/// misses.
double curvature2(const BasisVolume& volume, const std::vector<double>& weight, std::size_t a, std::size_t b,
                  std::size_t c) {
  double sum = 0;
  for (std::size_t r = 0; r < weight.size(); ++r) {
    const float* row = volume.basis.data() + r * volume.row_floats();
    double of_region = 0;
    for (std::size_t k = 0; k < 27; ++k) {
      const double d = static_cast<double>(row[27 * a + k] - 2.0f * row[27 * b + k] + row[27 * c + k]);
      of_region += d * d;
    }
    sum += weight[r] * of_region;
  }
  return sum;
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
  std::size_t stride = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const auto count = static_cast<std::size_t>(probes.count[axis]);
    std::vector<double> g(count, 0.0);
    for (std::size_t i = 0; i < probes.size(); ++i)
      if (const std::size_t at = i / stride % count;
          at > 0 && at + 1 < count && open(i - stride, i) && open(i, i + stride))
        g[at] += curvature2(coarse, weight, i - stride, i, i + stride);
    stride *= count;
    if (count < 3 || !(*std::ranges::max_element(g) > 0.0))
      continue; // nothing is known: regular along this axis
    g.front() = g[1];
    g.back() = g[count - 2];
    for (const double x : g)
      density[static_cast<std::size_t>(axis)].push_back(std::pow(x, kExponent));
  }
  return density;
}

/// Planes at equal parts of the integral of the piecewise linear density, first and last at the ends.
std::vector<double> planes_of(const std::vector<double>& density, int count, double first, double last) {
  std::vector<double> value = density.empty() ? std::vector<double>(2, 1.0) : density;
  const double mean = std::accumulate(value.begin(), value.end(), 0.0) / static_cast<double>(value.size());
  std::vector<double> before{0.0}; // integral up to each value, in steps
  for (std::size_t i = 0; i < value.size(); ++i) {
    value[i] = std::max(value[i], kThinnest * mean);
    if (i > 0)
      before.push_back(before.back() + 0.5 * (value[i - 1] + value[i]));
  }
  const double steps = static_cast<double>(value.size() - 1);
  std::vector<double> planes{first};
  std::size_t step = 0;
  for (int k = 1; k + 1 < count; ++k) {
    const double wanted = before.back() * k / (count - 1);
    while (step + 2 < value.size() && before[step + 1] <= wanted)
      ++step;
    // a t + (b - a) t^2 / 2 = rest, in the form that keeps its digits
    const double a = value[step], rise = value[step + 1] - a, rest = wanted - before[step];
    const double t = 2.0 * rest / (a + std::sqrt(std::max(a * a + 2.0 * rise * rest, 0.0)));
    planes.push_back(first + (last - first) * (static_cast<double>(step) + t) / steps);
  }
  planes.push_back(last);
  return planes;
}

} // namespace daylit::precompute
