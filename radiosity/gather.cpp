#include "radiosity/gather.h"

#include <algorithm>
#include <atomic>
#include <limits>
#include <numbers>

#include <cblas.h>
#include <glm/geometric.hpp>
#include <tbb/parallel_for.h>

#include "radiosity/detail/sampling.h"
#include "sh/sh9.h"

namespace daylit::radiosity {

namespace {

constexpr std::size_t kChunk = 32; ///< points per dense product

glm::vec3 ray_direction(std::size_t k, std::size_t rays, const glm::dvec2& shift) {
  return glm::vec3(fibonacci_direction(static_cast<std::uint32_t>(k), static_cast<std::uint32_t>(rays), shift));
}

/// The elements that a point's rays meet.
void trace_point(const glm::dvec3& point, std::size_t index, const ElementSet& set, const PatchMesh& mesh,
                 const RayScene& scene, std::span<std::int32_t> met) {
  const glm::dvec2 shift = random_shift(index);
  for (std::size_t k = 0; k < met.size(); ++k) {
    const glm::vec3 d = ray_direction(k, met.size(), shift);
    RayHit hit;
    met[k] = scene.closest(scene.to_local(point), d, 0.0f, std::numeric_limits<float>::infinity(), hit)
                 ? set.hit(mesh, hit.triangle, d)
                 : -1;
  }
}

std::vector<glm::vec2> ray_turns(std::size_t rays) {
  std::vector<glm::vec2> turn(rays);
  for (std::size_t k = 0; k < rays; ++k) {
    const glm::vec3 d = ray_direction(k, rays, {0.0, 0.0});
    turn[k] = glm::normalize(glm::vec2(d));
  }
  return turn;
}

/// Calls add(element, share of the harmonics, nine of them) for every ray of a point that meets an element. dw = 4 pi /
/// rays, L = B / pi. The directions are those of the rays, by a turn of the ones of shift 0.
template <class Add>
void for_each_hit(std::size_t index, std::span<const std::int32_t> met, std::span<const glm::vec2> turn,
                  const Add& add) {
  const glm::dvec2 shift = random_shift(index);
  const double own = 2.0 * std::numbers::pi * shift.y, n = static_cast<double>(met.size());
  const auto c = static_cast<float>(std::cos(own)), s = static_cast<float>(std::sin(own));
  const float share = 4.0f / static_cast<float>(met.size());
  for (std::size_t k = 0; k < met.size(); ++k) {
    if (met[k] < 0)
      continue;
    const auto z = static_cast<float>(1.0 - 2.0 * (static_cast<double>(k) + 0.25 + 0.5 * shift.x) / n);
    const float r = std::sqrt(std::max(0.0f, 1.0f - z * z));
    auto y = sh::evaluate9(glm::vec3(r * (turn[k].x * c - turn[k].y * s), r * (turn[k].x * s + turn[k].y * c), z));
    for (float& x : y)
      x *= share;
    add(static_cast<std::size_t>(met[k]), y);
  }
}

/// Adds one point's nine rows of weights: coefficient = weights . B.
void add_weights(std::size_t index, std::span<const std::int32_t> met, std::span<const glm::vec2> turn,
                 std::size_t elements, float* weights) {
  for_each_hit(index, met, turn, [&](std::size_t element, const auto& y) {
    for (std::size_t l = 0; l < 9; ++l)
      weights[l * elements + element] += y[l];
  });
}

/// Nine rows of weights for each of the points first .. first + count - 1.
std::vector<float> weights_of(const GatherHits& hits, std::size_t first, std::size_t count) {
  std::vector<float> weights(count * 9 * hits.elements());
  for (std::size_t p = 0; p < count; ++p)
    hits.weights(first + p, weights.data() + p * 9 * hits.elements());
  return weights;
}

/// rows x (3 channels x regions): fills the channels that are copies of others.
void copy_channels(float* values, std::size_t rows, std::size_t regions, const std::array<int, 3>& copy_of) {
  for (std::size_t c = 0; c < 3; ++c) {
    const auto from = static_cast<std::size_t>(copy_of[c]);
    for (std::size_t row = 0; row < rows && from != c; ++row)
      std::copy_n(values + (row * 3 + from) * regions, regions, values + (row * 3 + c) * regions);
  }
}

/// One channel of the first light, [element][region].
std::vector<float> channel_of(const FirstBounce& light, int channel) {
  std::vector<float> h(light.elements * light.columns());
  for (std::size_t i = 0; i < light.elements; ++i)
    std::copy_n(light.row(i, channel), light.columns(), h.data() + i * light.columns());
  return h;
}

} // namespace

Result<GatherHits> gather_hits(std::span<const glm::dvec3> points, const ElementSet& set, const PatchMesh& mesh,
                               const RayScene& patches, const GatherOptions& options, const Progress& progress,
                               std::size_t most_kept_rays) {
  GatherHits hits;
  hits.set_ = &set;
  hits.mesh_ = &mesh;
  hits.scene_ = &patches;
  hits.points_.assign(points.begin(), points.end());
  hits.rays_ = static_cast<std::size_t>(options.rays);
  hits.turn_ = ray_turns(hits.rays_);
  const std::size_t kept = std::min(points.size(), most_kept_rays / hits.rays_);
  hits.element_.resize(kept * hits.rays_);
  std::atomic<std::size_t> done{0};
  std::atomic<bool> stop{false};
  tbb::parallel_for(std::size_t{0}, kept, [&](std::size_t p) {
    if (stop)
      return;
    trace_point(points[p], p, set, mesh, patches, std::span(hits.element_).subspan(p * hits.rays_, hits.rays_));
    if (++done % kChunk == 0 && !progress("rays", static_cast<double>(done) / static_cast<double>(kept)))
      stop = true;
  });
  if (stop)
    return interrupted_error("rays");
  return hits;
}

void GatherHits::weights(std::size_t point, float* nine_rows) const {
  std::fill_n(nine_rows, 9 * elements(), 0.0f);
  if ((point + 1) * rays_ <= element_.size())
    return add_weights(point, std::span(element_).subspan(point * rays_, rays_), turn_, elements(), nine_rows);
  std::vector<std::int32_t> met(rays_);
  trace_point(points_[point], point, *set_, *mesh_, *scene_, met);
  add_weights(point, met, turn_, elements(), nine_rows);
}

Result<std::vector<float>> gather_coefficients(const GatherHits& hits, const Radiosity& radiosity,
                                               const Progress& progress) {
  openblas_set_num_threads(1);
  const std::size_t points = hits.points(), columns = radiosity.columns, regions = columns / 3;
  std::vector<float> result(points * 9 * columns, 0.0f);
  const std::size_t chunks = (points + kChunk - 1) / kChunk;
  std::atomic<std::size_t> done{0};
  std::atomic<bool> stop{false};
  tbb::parallel_for(std::size_t{0}, chunks, [&](std::size_t c) {
    if (stop || columns == 0)
      return;
    const std::size_t first = c * kChunk, count = std::min(kChunk, points - first);
    const std::vector<float> weights = weights_of(hits, first, count);
    const auto rows = static_cast<int>(9 * count), inner = static_cast<int>(hits.elements()),
               stride = static_cast<int>(columns);
    float* out = result.data() + first * 9 * columns;
    for (std::size_t channel = 0; channel < 3; ++channel)
      if (radiosity.copy_of[channel] == static_cast<int>(channel))
        cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, rows, static_cast<int>(regions), inner, 1.0f,
                    weights.data(), inner, radiosity.b.data() + channel * regions, stride, 0.0f,
                    out + channel * regions, stride);
    copy_channels(out, 9 * count, regions, radiosity.copy_of);
    if (!progress("volume", static_cast<double>(++done) / static_cast<double>(chunks)))
      stop = true;
  });
  if (stop)
    return interrupted_error("volume");
  return result;
}

Result<std::vector<float>> adjoint_coefficients(const GatherHits& hits, const ElementSet& set,
                                                const ExchangeMatrix& exchange, const FirstBounce& light,
                                                const SolveOptions& solve, const Progress& progress,
                                                SolveReport* report) {
  const std::size_t n = set.elements.size(), regions = light.columns(), rows = 9 * hits.points();
  const std::vector<float> weights = weights_of(hits, 0, hits.points());
  std::vector<float> result(rows * 3 * regions, 0.0f);
  const std::array<int, 3> copy_of = equal_channels(set, light);
  SolveReport total;
  total.channels = 0;
  for (int channel = 0; channel < 3; ++channel) {
    const auto c = static_cast<std::size_t>(channel);
    if (copy_of[c] != channel)
      continue;
    SolveReport one;
    const auto wanted = solve_adjoint(set, exchange, weights, rows, channel, solve, progress, &one);
    if (!wanted)
      return wanted.error();
    const std::vector<float> h = channel_of(light, channel);
    cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, static_cast<int>(rows), static_cast<int>(regions),
                static_cast<int>(n), 1.0f, wanted->data(), static_cast<int>(n), h.data(), static_cast<int>(regions),
                0.0f, result.data() + c * regions, static_cast<int>(3 * regions));
    total.iterations = std::max(total.iterations, one.iterations);
    total.worst_residual = std::max(total.worst_residual, one.worst_residual);
    total.residual.insert(total.residual.end(), one.residual.begin(), one.residual.end());
    total.seconds += one.seconds;
    ++total.channels;
  }
  copy_channels(result.data(), rows, regions, copy_of);
  if (report)
    *report = std::move(total);
  return result;
}

} // namespace daylit::radiosity
