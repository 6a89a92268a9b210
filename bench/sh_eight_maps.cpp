#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "bench/angular_map.h"
#include "bench/sh_sections.h"
#include "bench/timing.h"
#include "sh/band_probe.h"
#include "sh/transform.h"
#include "sh/zonal.h"

namespace daylit::bench {
namespace {

constexpr int kWidth = 1024, kHeight = 512;
constexpr std::size_t kMaps = 8;
constexpr double kEight[kMaps] = {1, 10, 40, 80, 160, 320, 640, 1280};
/// Half of 0.01 %: 64 directions judge half a million pixels.
constexpr double kTolerance = 0.5e-4;

/// One direction per cell of 8 x 8 in azimuth and colatitude, as the pixels of the map are spread.
struct Directions {
  std::vector<double> x, y, z;
};
Directions directions() {
  std::mt19937_64 engine(13);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  Directions d;
  for (int k = 0; k < 64; ++k) {
    const double theta = std::numbers::pi * (k / 8 + uniform(engine)) / 8.0;
    const double phi = 2.0 * std::numbers::pi * (k % 8 + uniform(engine)) / 8.0;
    d.x.push_back(std::sin(theta) * std::cos(phi));
    d.y.push_back(std::sin(theta) * std::sin(phi));
    d.z.push_back(std::cos(theta));
  }
  return d;
}

/// From an image in memory to eight maps in memory; the transforms are planned in the first run and kept.
class EightMaps {
public:
  explicit EightMaps(std::vector<float> image)
      : image_(std::move(image)), maps_(kMaps, std::vector<float>(image_.size())),
        grid_(*sh::equirectangular_grid(kWidth, kHeight)), most_(*sh::phong_degree(kEight[kMaps - 1], 1e-6)),
        probe_at_(directions()), coefficients_(sh::coefficient_count(most_) * 3) {}

  /// Seconds of analysis, choice of the degrees and synthesis.
  std::array<double, 3> run() {
    const double start = thread_seconds();
    if (plans_.empty())
      plans_.push_back(*sh::RingTransform::create(grid_, most_));
    (void)plans_[0].analyse(sh::interleaved<const float>(image_.data(), kWidth, 3), coefficients_);
    const double analysed = thread_seconds();
    const auto probe = sh::BandProbe::create(coefficients_, 3, probe_at_.x, probe_at_.y, probe_at_.z);
    for (std::size_t k = 0; k < kMaps; ++k)
      degrees[k] = probe->needed_degree(*sh::phong_mean_bands(kEight[k], most_), false, kTolerance);
    const double chosen = thread_seconds();
    for (std::size_t k = 0; k < kMaps; ++k) {
      if (plans_.size() == k + 1)
        plans_.push_back(*sh::RingTransform::create(grid_, degrees[k]));
      synthesise(plans_[k + 1], kEight[k], maps_[k]);
    }
    return {analysed - start, chosen - analysed, thread_seconds() - chosen};
  }

  /// Mean relative error of every map against the whole series, which leaves out less than 1e-6 of the lobe.
  std::vector<double> errors() {
    std::vector<double> out;
    std::vector<float> full(image_.size());
    for (std::size_t k = 0; k < kMaps; ++k) {
      synthesise(plans_[0], kEight[k], full);
      double sum = 0.0;
      for (std::size_t i = 0; i < full.size(); ++i)
        sum += std::abs(double(maps_[k][i]) - double(full[i])) / (std::abs(double(full[i])) + 1e-12);
      out.push_back(sum / double(full.size()));
    }
    return out;
  }

  std::array<int, kMaps> degrees{};

private:
  void synthesise(sh::RingTransform& plan, double exponent, std::vector<float>& map) {
    const std::size_t count = sh::coefficient_count(plan.degree()) * 3;
    std::vector<double> c(coefficients_.begin(), coefficients_.begin() + std::ptrdiff_t(count));
    (void)sh::convolve(*sh::phong_mean_bands(exponent, plan.degree()), 3, c);
    (void)plan.synthesise(c, sh::interleaved(map.data(), kWidth, 3));
  }

  std::vector<float> image_;
  std::vector<std::vector<float>> maps_;
  sh::RingGrid grid_;
  int most_;
  Directions probe_at_;
  std::vector<double> coefficients_;
  std::vector<sh::RingTransform> plans_; ///< the analysis, then one per map
};

} // namespace

Result<nlohmann::json> measure_eight_maps(const RgbImage& cross) {
  EightMaps maps(equirectangular_map(cross, kWidth, kHeight));
  const auto total = [](const std::array<double, 3>& t) { return t[0] + t[1] + t[2]; };
  const auto first = maps.run();
  auto best = first;
  for (int r = 0; r < 7; ++r)
    if (const auto t = maps.run(); total(t) < total(best))
      best = t;
  return nlohmann::json{{"exponents", kEight},
                        {"degrees", maps.degrees},
                        {"mean_errors", maps.errors()},
                        {"ms", 1e3 * total(best)},
                        {"ms_first_with_plans", 1e3 * total(first)},
                        {"analysis_ms", 1e3 * best[0]},
                        {"choice_ms", 1e3 * best[1]},
                        {"synthesis_ms", 1e3 * best[2]}};
}

} // namespace daylit::bench
