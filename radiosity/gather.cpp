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

/// Adds one point's nine rows of weights: coefficient = weights . B.
void trace_point(const glm::dvec3& point, std::uint64_t index, const ElementSet& set, const PatchMesh& mesh,
                 const RayScene& scene, int rays, float* weights) {
  const glm::dvec2 shift = random_shift(index);
  const std::size_t n = set.elements.size();
  // dw = 4 pi / rays, L = B / pi.
  const float share = 4.0f / static_cast<float>(rays);
  for (int k = 0; k < rays; ++k) {
    const glm::vec3 d(fibonacci_direction(static_cast<std::uint32_t>(k), static_cast<std::uint32_t>(rays), shift));
    RayHit hit;
    if (!scene.closest(scene.to_local(point), d, 0.0f, std::numeric_limits<float>::infinity(), hit))
      continue;
    const std::int32_t element = set.hit(mesh, hit.triangle, d);
    if (element < 0)
      continue;
    const auto y = sh::evaluate9(d);
    for (std::size_t l = 0; l < 9; ++l)
      weights[l * n + static_cast<std::size_t>(element)] += share * y[l];
  }
}

} // namespace

Result<std::vector<float>> gather_coefficients(std::span<const glm::dvec3> points, const ElementSet& set,
                                               const PatchMesh& mesh, const RayScene& patches,
                                               const Radiosity& radiosity, const GatherOptions& options,
                                               const Progress& progress) {
  openblas_set_num_threads(1);
  const std::size_t n = set.elements.size(), columns = radiosity.columns;
  std::vector<float> result(points.size() * 9 * columns, 0.0f);
  const std::size_t chunks = (points.size() + kChunk - 1) / kChunk;
  std::atomic<std::size_t> done{0};
  std::atomic<bool> stop{false};
  tbb::parallel_for(std::size_t{0}, chunks, [&](std::size_t c) {
    if (stop || columns == 0)
      return;
    const std::size_t first = c * kChunk, count = std::min(kChunk, points.size() - first);
    std::vector<float> weights(count * 9 * n, 0.0f);
    for (std::size_t p = 0; p < count; ++p)
      trace_point(points[first + p], first + p, set, mesh, patches, options.rays, weights.data() + p * 9 * n);
    const auto rows = static_cast<int>(9 * count), inner = static_cast<int>(n), width = static_cast<int>(columns);
    cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, rows, width, inner, 1.0f, weights.data(), inner,
                radiosity.b.data(), width, 0.0f, result.data() + first * 9 * columns, width);
    if (!progress("volume", static_cast<double>(++done) / static_cast<double>(chunks)))
      stop = true;
  });
  if (stop)
    return interrupted_error("volume");
  return result;
}

} // namespace daylit::radiosity
