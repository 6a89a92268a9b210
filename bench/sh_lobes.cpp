#include <cmath>
#include <numbers>
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

/// One pixel, chosen at random, of every `cell` x `cell` block that the circle covers.
std::vector<std::size_t> one_per_cell(const AngularMap& map, int cell, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  const int cells = kSide / cell;
  std::vector<std::size_t> chosen(std::size_t(cells) * std::size_t(cells), map.x.size());
  std::vector<int> seen(chosen.size(), 0);
  for (std::size_t i = 0; i < map.x.size(); ++i) {
    const std::size_t k = std::size_t(map.row[i] / cell * cells + map.column[i] / cell);
    if (std::uniform_int_distribution<int>(0, seen[k]++)(engine) == 0) // reservoir of one
      chosen[k] = i;
  }
  std::erase(chosen, map.x.size());
  return chosen;
}

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
  for (const std::size_t i : one_per_cell(a.map, 16, 11)) {
    x.push_back(a.map.x[i]);
    y.push_back(a.map.y[i]);
    z.push_back(a.map.z[i]);
  }
  auto probe = sh::BandProbe::create(a.coefficients, 4, x, y, z);
  if (!probe)
    return convert(probe.error());
  return std::move(*probe);
}

/// Smallest degree with a mean error below the tolerance, against direct summation, by bisection below `chosen`.
Result<int> needed_degree(const Analysis& a, const std::vector<double>& truth, std::size_t lobe, int chosen,
                          std::span<const std::size_t> outputs) {
  int low = 0, high = chosen; // error(high) is below, error(low) above
  std::vector<double> values(truth.size());
  for (low = int(chosen * 0.8) - 1; low + 1 < high;) {
    const int middle = (low + high) / 2;
    const auto v = lobe_values(a, kExponents[lobe], middle, outputs);
    if (!v)
      return v.error();
    scatter(values, *v, lobe);
    (map_error(truth, values, lobe).mean < kTolerance ? high : low) = middle;
  }
  return high;
}

} // namespace

Result<nlohmann::json> measure_lobe_maps(const RgbImage& cross, const Step& step) {
  if (!step("probe: analysis", 0.0))
    return interrupted_error("daylit-bench sh");
  auto a = analyse(cross);
  if (!a)
    return a.error();
  const auto outputs = one_per_cell(a->map, 8, 12);
  if (!step("probe: direct summation", 0.05))
    return interrupted_error("daylit-bench sh");
  std::vector<double> truth, ours;
  const double direct_seconds = time_once([&] { truth = direct_lobes(a->map, outputs); });
  ours.resize(truth.size());
  std::vector<double> exact35(truth.size());
  const auto float35 = factorial_lobes(a->map, outputs, 35), float50 = factorial_lobes(a->map, outputs, 50);
  std::vector<std::size_t> all(a->map.x.size());
  for (std::size_t i = 0; i < all.size(); ++i)
    all[i] = i;
  const double probe_start = thread_seconds();
  const auto probe = probe_of(*a);
  if (!probe)
    return probe.error();
  const double probe_seconds = thread_seconds() - probe_start;
  nlohmann::json rows = nlohmann::json::array();
  for (std::size_t k = 0; k < kLobes; ++k) {
    if (!step("probe: exponent " + std::to_string(int(kExponents[k])), 0.2 + 0.8 * double(k) / kLobes))
      return interrupted_error("daylit-bench sh");
    const auto bands = *sh::phong_mean_bands(kExponents[k], a->degree);
    const int degree = probe->needed_degree(bands, true, kMargin * kTolerance);
    const auto at_outputs = lobe_values(*a, kExponents[k], degree, outputs);
    const auto at_34 = lobe_values(*a, kExponents[k], 34, outputs);
    if (!at_outputs || !at_34)
      return !at_outputs ? at_outputs.error() : at_34.error();
    scatter(ours, *at_outputs, k);
    scatter(exact35, *at_34, k);
    const auto needed = needed_degree(*a, truth, k, degree, outputs);
    if (!needed)
      return needed.error();
    const double seconds = time_once([&] { (void)lobe_values(*a, kExponents[k], degree, all); });
    const MapError e = map_error(truth, ours, k);
    rows.push_back({{"exponent", kExponents[k]},
                    {"degree", degree},
                    {"needed_degree", *needed},
                    {"degree_over_needed", double(degree) / double(std::max(1, *needed))},
                    {"mean_error", e.mean},
                    {"max_error", e.max},
                    {"ms", 1e3 * seconds},
                    {"order_35_exact_mean_error", map_error(truth, exact35, k).mean},
                    {"order_35_float_factorials_mean_error", map_error(truth, float35, k).mean},
                    {"order_50_float_factorials_mean_error", map_error(truth, float50, k).mean}});
  }
  return nlohmann::json{{"pixels", a->map.x.size()},
                        {"compared_pixels", outputs.size()},
                        {"analysis_degree", a->degree},
                        {"analysis_ms", 1e3 * a->seconds},
                        {"degree_choice_ms", 1e3 * probe_seconds},
                        {"direct_summation_ms_per_map_estimated",
                         1e3 * direct_seconds / double(outputs.size()) * double(a->map.x.size()) / double(kLobes)},
                        {"maps", rows}};
}

Result<nlohmann::json> measure_eight_maps(const RgbImage& cross) {
  constexpr int kWidth = 1024, kHeight = 512;
  constexpr double kEight[] = {1, 10, 40, 80, 160, 320, 640, 1280};
  const std::vector<float> image = equirectangular_map(cross, kWidth, kHeight);
  std::vector<std::vector<float>> maps(8, std::vector<float>(image.size()));
  const auto grid = *sh::equirectangular_grid(kWidth, kHeight);
  const int most = *sh::phong_degree(kEight[7], 1e-6);
  std::mt19937_64 engine(13);
  std::vector<double> x, y, z;
  for (int k = 0; k < 64; ++k) { // one pixel per cell of 8 x 8
    const double theta = std::numbers::pi * (k / 8 + std::uniform_real_distribution<>(0, 1)(engine)) / 8.0;
    const double phi = 2.0 * std::numbers::pi * (k % 8 + std::uniform_real_distribution<>(0, 1)(engine)) / 8.0;
    x.push_back(std::sin(theta) * std::cos(phi));
    y.push_back(std::sin(theta) * std::sin(phi));
    z.push_back(std::cos(theta));
  }
  auto analysis = sh::RingTransform::create(grid, most);
  std::vector<sh::RingTransform> plans;
  std::vector<int> degrees(8, 0);
  std::vector<double> coefficients(sh::coefficient_count(most) * 3);
  double parts[3] = {};
  const auto run = [&](bool plan) {
    const double t0 = thread_seconds();
    (void)analysis->analyse(sh::interleaved(image.data(), kWidth, 3), coefficients);
    const double t1 = thread_seconds();
    const auto probe = sh::BandProbe::create(coefficients, 3, x, y, z);
    for (std::size_t k = 0; k < 8; ++k)
      degrees[k] = probe->needed_degree(*sh::phong_mean_bands(kEight[k], most), false, 0.5 * kTolerance);
    const double t2 = thread_seconds();
    for (std::size_t k = 0; k < 8; ++k) {
      if (plan)
        plans.push_back(*sh::RingTransform::create(grid, degrees[k]));
      std::vector<double> c(coefficients.begin(),
                            coefficients.begin() + std::ptrdiff_t(sh::coefficient_count(degrees[k]) * 3));
      (void)sh::convolve(*sh::phong_mean_bands(kEight[k], degrees[k]), 3, c);
      (void)plans[k].synthesise(c, sh::interleaved(maps[k].data(), kWidth, 3));
    }
    parts[0] = t1 - t0, parts[1] = t2 - t1, parts[2] = thread_seconds() - t2;
    return thread_seconds() - t0;
  };
  const double first = run(true);
  double best = first;
  for (int r = 0; r < 7; ++r)
    best = std::min(best, run(false));
  std::vector<double> errors;
  for (std::size_t k = 0; k < 8; ++k) { // against the whole series, which leaves out less than 1e-6 of the lobe
    std::vector<double> c(coefficients);
    std::vector<float> full(image.size());
    (void)sh::convolve(*sh::phong_mean_bands(kEight[k], most), 3, c);
    (void)analysis->synthesise(c, sh::interleaved(full.data(), kWidth, 3));
    double sum = 0.0;
    for (std::size_t i = 0; i < full.size(); ++i)
      sum += std::abs(double(maps[k][i]) - double(full[i])) / (std::abs(double(full[i])) + 1e-12);
    errors.push_back(sum / double(full.size()));
  }
  return nlohmann::json{{"mean_errors", errors},
                        {"exponents", kEight},
                        {"degrees", degrees},
                        {"ms", 1e3 * best},
                        {"ms_first_with_plans", 1e3 * first},
                        {"last_analysis_ms", 1e3 * parts[0]},
                        {"last_choice_ms", 1e3 * parts[1]},
                        {"last_synthesis_ms", 1e3 * parts[2]}};
}

} // namespace daylit::bench
