#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>

#include <glm/common.hpp>

#include "runtime/maps/detail/prefilter_methods.h"
#include "scene/core/parallel.h"
#include "sh/band_probe.h"
#include "sh/direction_transform.h"
#include "sh/transform.h"
#include "sh/zonal.h"

namespace daylit::detail {
namespace {

/// Red, green, blue, and the weight that the others are divided by.
constexpr int kChannels = 4;
/// Parts of a map that threads transform side by side; a sum over parts has a fixed order.
constexpr std::size_t kParts = 4;
/// The analysis goes to the degree at which the lobes' bands fall below this part of the tolerance.
constexpr double kAnalysed = 1.0 / 30.0;
/// Degrees are chosen for this part of the tolerance: the probe sees some of the texels.
constexpr double kMargin = 0.6;
constexpr int kProbes = 96;
/// Degrees to a side of the map beyond which no analysis goes: it resolves about one.
constexpr int kMostDegree = 2;

/// Whole rings of texels, the diamonds |u| + |v| = const, every kParts-th of them: each |z| is in one part.
struct MapPart {
  std::vector<std::size_t> texel;
  std::vector<double> x, y, z;
  std::optional<sh::DirectionTransform> transform; ///< of degree 0; none of a part without texels
};

struct MapParts {
  std::array<MapPart, kParts> parts;

  explicit MapParts(int side);
};

/// The mirror images of a texel of the quadrant u, v > 0, which is (a, b) texels from the centre of the square.
void add_images(const RadianceMap& map, int a, int b, MapPart& part) {
  const int half = map.side / 2;
  const glm::dvec3 w = map.direction(static_cast<std::size_t>(half + b) * map.side + half + a);
  for (int image = 0; image < 4; ++image) {
    const int column = image % 2 ? half - 1 - a : half + a, row = image / 2 ? half - 1 - b : half + b;
    part.texel.push_back(static_cast<std::size_t>(row) * map.side + column);
    part.x.push_back(image % 2 ? -w.x : w.x);
    part.y.push_back(image / 2 ? -w.y : w.y);
    part.z.push_back(w.z);
  }
}

/// Ring by ring from the poles, as transforms sort directions.
MapParts::MapParts(int side) {
  RadianceMap map;
  map.side = side;
  const int half = side / 2;
  parallel_for(0, static_cast<int>(kParts), [&](int p) {
    MapPart& part = parts[static_cast<std::size_t>(p)];
    for (int ring = p + 1; ring <= half; ring += static_cast<int>(kParts)) {
      for (int a = 0; a < ring; ++a)
        add_images(map, a, ring - 1 - a, part);
      for (int a = ring - 1; a >= 0 && ring < half; --a)
        add_images(map, half - 1 - a, half - ring + a, part);
    }
    if (!part.texel.empty())
      part.transform.emplace(*sh::DirectionTransform::create(part.x, part.y, part.z, 0));
  });
}

class HarmonicLobes {
public:
  explicit HarmonicLobes(const PrefilterJob& job) : job_(job) {
    for (const Lobe& lobe : job.lobes)
      degree_ = std::max(degree_, *sh::phong_degree(lobe.exponent, kAnalysed * job.options.tolerance));
  }

  void run() {
    do {
      analyse();
      choose_degrees();
    } while (!job_.options.stop.stop_requested() && more_is_needed());
    for (const Lobe& lobe : job_.lobes)
      parts_of(lobe.side);
    std::vector<std::atomic<std::size_t>> left(job_.lobes.size());
    for (auto& l : left)
      l = kParts;
    // the costly ones first, so that the threads end together
    parallel_for(tbb::blocked_range<std::size_t>(0, job_.lobes.size() * kParts, 1), [&](const auto& range) {
      for (std::size_t i = range.begin(); i != range.end() && !job_.options.stop.stop_requested(); ++i) {
        const std::size_t k = order_[i / kParts];
        synthesise(k, i % kParts);
        if (--left[k] == 0 && job_.options.tile_done)
          done(k);
      }
    });
  }

private:
  const std::array<MapPart, kParts>& parts_of(int side) { return parts_.try_emplace(side, side).first->second.parts; }

  void done(std::size_t lobe) const {
    std::vector<std::uint32_t> all(job_.maps[lobe].radiance.size());
    std::iota(all.begin(), all.end(), 0u);
    job_.options.tile_done({lobe, all}, job_.maps[lobe]);
  }
  /// The last eighth of the degrees still matters to a lobe: what lies beyond is not known to be small.
  bool more_is_needed() {
    const int most = std::max(degree_, kMostDegree * job_.source.side);
    const int needed = *std::max_element(degrees_.begin(), degrees_.end());
    if (8 * needed <= 7 * degree_ || degree_ == most)
      return false;
    degree_ = std::min(most, 2 * degree_);
    return true;
  }
  void analyse();
  void choose_degrees();
  void synthesise(std::size_t lobe, std::size_t part);

  const PrefilterJob& job_;
  int degree_ = 0;
  std::map<int, MapParts> parts_;
  std::vector<double> coefficients_;
  std::vector<int> degrees_;
  std::vector<std::size_t> order_; ///< lobes by falling degree
};

/// L_lm = sum over texels of L_i Y_lm(w_i), and of Y_lm(w_i): no solid angles, they are equal and divide out.
void HarmonicLobes::analyse() {
  const auto& parts = parts_of(job_.source.side);
  const std::size_t count = sh::coefficient_count(degree_) * kChannels;
  std::array<std::vector<double>, kParts> sums;
  parallel_for(std::size_t(0), kParts, [&](std::size_t p) {
    std::vector<double> values, ones(parts[p].x.size(), 1.0);
    for (const std::size_t t : parts[p].texel)
      for (int c = 0; c < kChannels; ++c)
        values.push_back(c < 3 ? static_cast<double>(job_.source.radiance[t][c]) : 1.0);
    sums[p].resize(count);
    if (parts[p].transform)
      (void)parts[p].transform->at_degree(degree_)->analyse(values, ones, kChannels, sums[p]);
  });
  coefficients_.assign(count, 0.0);
  for (const auto& sum : sums)
    for (std::size_t i = 0; i < count; ++i)
      coefficients_[i] += sum[i];
}

/// The degree at which the mean error in some directions, spread evenly (Fibonacci), falls below the tolerance.
void HarmonicLobes::choose_degrees() {
  std::vector<double> x, y, z;
  for (int k = 0; k < kProbes; ++k) {
    z.push_back(1.0 - (2.0 * k + 1.0) / kProbes);
    const double phi = 2.0 * std::numbers::pi * k / std::numbers::phi, r = std::sqrt(1.0 - z.back() * z.back());
    x.push_back(r * std::cos(phi));
    y.push_back(r * std::sin(phi));
  }
  const auto probe = sh::BandProbe::create(coefficients_, kChannels, x, y, z);
  degrees_.clear();
  for (const Lobe& lobe : job_.lobes)
    degrees_.push_back(std::max(1, probe->needed_degree(*sh::phong_mean_bands(lobe.exponent, degree_), true,
                                                        kMargin * job_.options.tolerance)));
  order_.resize(degrees_.size());
  for (std::size_t k = 0; k < order_.size(); ++k)
    order_[k] = k;
  std::stable_sort(order_.begin(), order_.end(),
                   [&](std::size_t a, std::size_t b) { return degrees_[a] > degrees_[b]; });
}

/// sum_lm A_l L_lm Y_lm over the same sum of the weights (Funk-Hecke, sh/zonal.h): exactly the sum over texels, but for
/// the bands above the degree, since every band takes the texels themselves as its quadrature.
void HarmonicLobes::synthesise(std::size_t lobe, std::size_t part) {
  const MapPart& to = parts_.at(job_.lobes[lobe].side).parts[part];
  if (!to.transform)
    return;
  const int degree = degrees_[lobe];
  const std::size_t count = sh::coefficient_count(degree) * kChannels;
  std::vector<double> c(coefficients_.begin(), coefficients_.begin() + static_cast<std::ptrdiff_t>(count));
  (void)sh::convolve(*sh::phong_mean_bands(job_.lobes[lobe].exponent, degree), kChannels, c);
  std::vector<double> values(kChannels * to.texel.size());
  (void)to.transform->at_degree(degree)->synthesise(c, kChannels, values);
  for (std::size_t i = 0; i < to.texel.size(); ++i) {
    const double* v = &values[kChannels * i];
    job_.maps[lobe].radiance[to.texel[i]] = glm::max(Rgb(glm::dvec3(v[0], v[1], v[2]) / v[3]), Rgb(0.0f));
  }
}

} // namespace

void harmonic_lobes(const PrefilterJob& job) {
  if (!job.lobes.empty())
    HarmonicLobes(job).run();
}

} // namespace daylit::detail
