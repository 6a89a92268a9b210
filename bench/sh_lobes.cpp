#include <cmath>
#include <numeric>
#include <random>

#include "bench/lobe_reference.h"
#include "bench/sh_sections.h"
#include "bench/timing.h"
#include "sh/band_probe.h"
#include "sh/direction_transform.h"
#include "sh/transform.h"
#include "sh/zonal.h"

namespace daylit::bench {
namespace {

constexpr int kSide = 512;
constexpr double kTolerance = 1e-4;
/// The degree is chosen for a little less than the tolerance: the probe sees some hundred pixels, not all.
constexpr double kMargin = 0.85;
constexpr std::size_t kLobes = kExponents.size();

Error convert(const sh::Error& e) { return {ErrorCode::value_invalid, e.what, e.where, ""}; }

/// Equation 6.1 of the thesis: mean over pixels and channels of |a - v| / a, for one exponent.
struct MapError {
  double mean = 0.0, max = 0.0;
};
MapError map_error(const std::vector<double>& truth, const std::vector<double>& values, std::size_t lobe) {
  MapError e;
  const std::size_t outputs = truth.size() / (3 * kLobes);
  for (std::size_t o = 0; o < outputs; ++o)
    for (std::size_t c = 0; c < 3; ++c) {
      const std::size_t i = (o * kLobes + lobe) * 3 + c;
      const double off = std::abs(truth[i] - values[i]) / (truth[i] + 1e-12);
      e.mean += off / double(3 * outputs);
      e.max = std::max(e.max, off);
    }
  return e;
}

/// The probe and its analysis: channel 3 holds the sum of weights, by which algorithm 4.1 divides.
struct Analysis {
  AngularMap map;
  int degree = 0;
  std::vector<double> coefficients;
  double seconds = 0.0;
};

Result<Analysis> analyse(const RgbImage& cross) {
  Analysis a;
  a.map = angular_map(cross, kSide);
  a.degree = *sh::phong_degree(kExponents.back(), 1e-7);
  std::vector<double> four;
  for (std::size_t i = 0; i < a.map.x.size(); ++i) {
    four.insert(four.end(), a.map.values.begin() + std::ptrdiff_t(3 * i),
                a.map.values.begin() + std::ptrdiff_t(3 * i + 3));
    four.push_back(1.0);
  }
  a.coefficients.resize(sh::coefficient_count(a.degree) * 4);
  const double start = thread_seconds();
  auto transform = sh::DirectionTransform::create(a.map.x, a.map.y, a.map.z, a.degree);
  if (!transform)
    return convert(transform.error());
  if (const auto ok = transform->analyse(four, a.map.solid_angle, 4, a.coefficients); !ok)
    return convert(ok.error());
  a.seconds = thread_seconds() - start;
  return a;
}

/// The lobe map at the given pixels, cut at `degree`. [output][3]
Result<std::vector<double>> lobe_values(const Analysis& a, double exponent, int degree,
                                        std::span<const std::size_t> outputs) {
  std::vector<double> x, y, z,
      c(a.coefficients.begin(), a.coefficients.begin() + std::ptrdiff_t(sh::coefficient_count(degree) * 4));
  for (const std::size_t o : outputs) {
    x.push_back(a.map.x[o]);
    y.push_back(a.map.y[o]);
    z.push_back(a.map.z[o]);
  }
  auto transform = sh::DirectionTransform::create(x, y, z, degree);
  if (!transform)
    return convert(transform.error());
  std::vector<double> four(4 * outputs.size()), out;
  (void)sh::convolve(*sh::phong_mean_bands(exponent, degree), 4, c);
  if (const auto ok = transform->synthesise(c, 4, four); !ok)
    return convert(ok.error());
  for (std::size_t o = 0; o < outputs.size(); ++o)
    for (std::size_t k = 0; k < 3; ++k)
      out.push_back(four[4 * o + k] / four[4 * o + 3]);
  return out;
}

void scatter(std::vector<double>& all, const std::vector<double>& values, std::size_t lobe) {
  for (std::size_t i = 0; i < values.size(); ++i)
    all[(i / 3 * kLobes + lobe) * 3 + i % 3] = values[i];
}

Result<sh::BandProbe> probe_of(const Analysis& a) {
  std::vector<double> x, y, z;
  for (const std::size_t i : one_per_cell(a.map, kSide, 16, 11)) {
    x.push_back(a.map.x[i]);
    y.push_back(a.map.y[i]);
    z.push_back(a.map.z[i]);
  }
  auto probe = sh::BandProbe::create(a.coefficients, 4, x, y, z);
  if (!probe)
    return convert(probe.error());
  return std::move(*probe);
}

/// What every exponent is compared with. [output][exponent][3]
struct References {
  std::vector<double> truth, float35, float50;
  double direct_seconds = 0.0;
};

References references(const AngularMap& map, std::span<const std::size_t> outputs) {
  References r;
  r.direct_seconds = time_once([&] { r.truth = direct_lobes(map, outputs); });
  r.float35 = factorial_lobes(map, outputs, 35);
  r.float50 = factorial_lobes(map, outputs, 50);
  return r;
}

Result<MapError> error_at(const Analysis& a, const References& r, std::size_t lobe, int degree,
                          std::span<const std::size_t> outputs) {
  const auto values = lobe_values(a, kExponents[lobe], degree, outputs);
  if (!values)
    return values.error();
  std::vector<double> all(r.truth.size());
  scatter(all, *values, lobe);
  return map_error(r.truth, all, lobe);
}

/// Smallest degree with a mean error below the tolerance, against direct summation, by bisection. When the chosen
/// degree misses the tolerance the search goes on above it.
Result<int> needed_degree(const Analysis& a, const References& r, std::size_t lobe, int chosen,
                          std::span<const std::size_t> outputs) {
  int low = int(chosen * 0.8) - 1, high = int(chosen * 1.1) + 1; // error(low) is above, error(high) below
  while (low + 1 < high) {
    const int middle = (low + high) / 2;
    const auto e = error_at(a, r, lobe, middle, outputs);
    if (!e)
      return e.error();
    (e->mean < kTolerance ? high : low) = middle;
  }
  return high;
}

/// One row of the table: the order chosen from the coefficients alone, its error, and the smallest that would do.
Result<nlohmann::json> measure_lobe(const Analysis& a, const sh::BandProbe& probe, const References& r,
                                    std::size_t lobe, std::span<const std::size_t> outputs) {
  const auto bands = *sh::phong_mean_bands(kExponents[lobe], a.degree);
  const int degree = probe.needed_degree(bands, true, kMargin * kTolerance);
  const auto ours = error_at(a, r, lobe, degree, outputs), at_34 = error_at(a, r, lobe, 34, outputs);
  const auto needed = needed_degree(a, r, lobe, degree, outputs);
  if (!ours || !at_34 || !needed)
    return !ours ? ours.error() : !at_34 ? at_34.error() : needed.error();
  std::vector<std::size_t> all(a.map.x.size());
  std::iota(all.begin(), all.end(), std::size_t(0));
  const double seconds = time_once([&] { (void)lobe_values(a, kExponents[lobe], degree, all); });
  return nlohmann::json{{"exponent", kExponents[lobe]},
                        {"degree", degree},
                        {"needed_degree", *needed},
                        {"degree_over_needed", double(degree) / double(std::max(1, *needed))},
                        {"mean_error", ours->mean},
                        {"max_error", ours->max},
                        {"ms", 1e3 * seconds},
                        {"order_35_exact_mean_error", at_34->mean},
                        {"order_35_float_factorials_mean_error", map_error(r.truth, r.float35, lobe).mean},
                        {"order_50_float_factorials_mean_error", map_error(r.truth, r.float50, lobe).mean}};
}

} // namespace

Result<nlohmann::json> measure_lobe_maps(const RgbImage& cross, const Step& step) {
  if (!step("probe: analysis", 0.0))
    return interrupted_error("daylit-bench sh");
  const auto a = analyse(cross);
  if (!a)
    return a.error();
  if (!step("probe: direct summation", 0.05))
    return interrupted_error("daylit-bench sh");
  const auto outputs = one_per_cell(a->map, kSide, 8, 12);
  const References r = references(a->map, outputs);
  const double start = thread_seconds();
  const auto probe = probe_of(*a);
  if (!probe)
    return probe.error();
  const double probe_seconds = thread_seconds() - start;
  nlohmann::json rows = nlohmann::json::array();
  for (std::size_t k = 0; k < kLobes; ++k) {
    if (!step("probe: exponent " + std::to_string(int(kExponents[k])), 0.2 + 0.8 * double(k) / kLobes))
      return interrupted_error("daylit-bench sh");
    auto row = measure_lobe(*a, *probe, r, k, outputs);
    if (!row)
      return row.error();
    rows.push_back(*row);
  }
  const double pixels = double(a->map.x.size());
  return nlohmann::json{{"pixels", a->map.x.size()},
                        {"compared_pixels", outputs.size()},
                        {"analysis_degree", a->degree},
                        {"analysis_ms", 1e3 * a->seconds},
                        {"degree_choice_ms", 1e3 * probe_seconds},
                        {"direct_summation_ms_per_map_estimated",
                         1e3 * r.direct_seconds / double(outputs.size()) * pixels / double(kLobes)},
                        {"maps", rows}};
}

} // namespace daylit::bench
