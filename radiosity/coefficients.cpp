#include "radiosity/coefficients.h"

#include <algorithm>
#include <array>
#include <numeric>

#include <cblas.h>

#include "scene/core/parallel_stage.h"

namespace daylit::radiosity {

namespace {

constexpr std::size_t kChunk = 32; ///< points per dense product

/// Nine rows of weights for each of the points.
std::vector<float> weights_of(const GatherHits& hits, std::span<const std::size_t> points, Bands bands) {
  std::vector<float> weights(points.size() * 9 * hits.patches());
  for (std::size_t p = 0; p < points.size(); ++p)
    hits.weights(points[p], weights.data() + p * 9 * hits.patches(), bands);
  return weights;
}

std::vector<std::size_t> all_points(const GatherHits& hits) {
  std::vector<std::size_t> points(hits.points());
  std::iota(points.begin(), points.end(), std::size_t{0});
  return points;
}

/// to[row][column] = a[row][inner] b[inner][column]; b and `to` are parts of wider matrices of `stride` columns.
void product(std::span<const float> a, std::size_t inner, const float* b, std::size_t columns, std::size_t b_stride,
             std::size_t stride, float* to) {
  const auto n = static_cast<int>(inner);
  cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, static_cast<int>(a.size() / inner), static_cast<int>(columns),
              n, 1.0f, a.data(), n, b, static_cast<int>(b_stride), 0.0f, to, static_cast<int>(stride));
}

/// rows x (3 channels x regions): fills the channels that are copies of others.
void copy_channels(float* values, std::size_t rows, std::size_t regions, const std::array<int, 3>& copy_of) {
  for (std::size_t c = 0; c < 3; ++c) {
    const auto from = static_cast<std::size_t>(copy_of[c]);
    for (std::size_t row = 0; row < rows && from != c; ++row)
      std::copy_n(values + (row * 3 + from) * regions, regions, values + (row * 3 + c) * regions);
  }
}

/// One channel of the direct light, [patch][region].
std::vector<float> channel_of(const FirstBounce& light, int channel) {
  std::vector<float> h(light.patches * light.columns());
  for (std::size_t i = 0; i < light.patches; ++i)
    std::copy_n(light.row(i, channel), light.columns(), h.data() + i * light.columns());
  return h;
}

} // namespace

Result<std::vector<float>> gather_coefficients(const GatherHits& hits, const Radiosity& radiosity,
                                               const Progress& progress, Bands bands) {
  return gather_coefficients(hits, all_points(hits), radiosity, progress, bands);
}

/// L_lm[point] = sum_j weights[lm][j] B_j, for all columns at once.
Result<std::vector<float>> gather_coefficients(const GatherHits& hits, std::span<const std::size_t> points,
                                               const Radiosity& radiosity, const Progress& progress, Bands bands) {
  openblas_set_num_threads(1);
  const std::size_t columns = radiosity.columns, regions = columns / 3;
  std::vector<float> result(points.size() * 9 * columns, 0.0f);
  const std::size_t chunks = columns > 0 ? (points.size() + kChunk - 1) / kChunk : 0;
  const Result<void> gathered = parallel_stage("volume", chunks, 1, progress, [&](std::size_t c) {
    const std::size_t first = c * kChunk, count = std::min(kChunk, points.size() - first);
    const std::vector<float> weights = weights_of(hits, points.subspan(first, count), bands);
    float* out = result.data() + first * 9 * columns;
    for (std::size_t channel = 0; channel < 3; ++channel)
      if (radiosity.copy_of[channel] == static_cast<int>(channel))
        product(weights, hits.patches(), radiosity.b.data() + channel * regions, regions, columns, columns,
                out + channel * regions);
    copy_channels(out, 9 * count, regions, radiosity.copy_of);
  });
  if (!gathered)
    return gathered.error();
  return result;
}

/// L_lm = w . B = h . H with the adjoint weights h of solve_adjoint() and the direct irradiance H.
Result<std::vector<float>> adjoint_coefficients(const GatherHits& hits, const PatchSet& set,
                                                const ExchangeMatrix& exchange, const FirstBounce& light,
                                                const SolveOptions& solve, const Progress& progress,
                                                SolveReport* report, Bands bands) {
  const std::size_t n = set.patches.size(), regions = light.columns(), rows = 9 * hits.points();
  const std::vector<float> weights = weights_of(hits, all_points(hits), bands);
  std::vector<float> result(rows * 3 * regions, 0.0f);
  const std::array<int, 3> copy_of = equal_channels(set, light);
  SolveReport total;
  for (int channel = 0; channel < 3; ++channel) {
    const auto c = static_cast<std::size_t>(channel);
    if (copy_of[c] != channel)
      continue;
    SolveReport one;
    const auto wanted = solve_adjoint(set, exchange, weights, rows, channel, solve, progress, &one);
    if (!wanted)
      return wanted.error();
    const std::vector<float> h = channel_of(light, channel);
    product(*wanted, n, h.data(), regions, regions, 3 * regions, result.data() + c * regions);
    total.add(one);
  }
  copy_channels(result.data(), rows, regions, copy_of);
  if (report)
    *report = std::move(total);
  return result;
}

} // namespace daylit::radiosity
