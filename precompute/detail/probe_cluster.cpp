#include "precompute/detail/probe_cluster.h"

#include "precompute/detail/random_signs.h"

namespace daylit::precompute::detail {

namespace {

constexpr double kRangeShare = 0.07; ///< of the allowed error: what the rows may lose before they are factorised

void scale_columns(std::vector<float>& rows, const std::vector<float>& scale) {
  for (std::size_t k = 0; k < rows.size(); ++k)
    rows[k] *= scale[k % scale.size()];
}

double squares(const std::vector<float>& a) {
  double sum = 0;
  for (const float x : a)
    sum += static_cast<double>(x) * static_cast<double>(x);
  return sum;
}

} // namespace

std::vector<float> Measure::suns(std::size_t count) const {
  std::vector<float> sun = columns.random_suns(weight, count);
  for (std::size_t k = 0; k < sun.size(); ++k)
    sun[k] /= metric.sigma[k / count];
  return sun;
}

/// [channel][coefficient][projection]
std::vector<float> ProbeCluster::signs() const { return random_signs(id + 16, 3 * coefficients() * kProjections); }

/// projected = sum over channels of signs^T transport: the expected square of its product with any light is the squared
/// norm of the cluster's field, times the number of projections (Hutchinson's estimate of a trace).
void ProbeCluster::project(const SurfaceTransport& surfaces, const std::vector<float>& rows) {
  const std::size_t n = coefficients(), parts = seen.part.size();
  const std::vector<float> sign = signs();
  projected.assign(kProjections * seen.lit.size(), 0.0f);
  for (std::size_t c = 0; c < 3; ++c)
    surfaces.add_adjoint(static_cast<int>(c),
                         multiply_transposed(std::span(sign).subspan(c * n * kProjections, n * kProjections), rows, n,
                                             kProjections, parts),
                         kProjections, seen, projected);
}

void ProbeCluster::reduce(const SurfaceLight& light, const SurfaceTransport& surfaces, const GatherRows& gather,
                          const std::vector<float>& radiosity, double error) {
  const std::size_t n = coefficients(), columns = radiosity.size() / light.elements;
  std::vector<std::uint8_t> distinguished(light.patches, 0);
  gather.distinguished(point, distinguished);
  seen = SeenParts::of(light, distinguished);
  const std::size_t parts = seen.part.size();
  std::vector<float> rows(n * parts);
  gather.rows(point, seen.end, rows.data());
  project(surfaces, rows);
  const std::vector<float> means = seen.means(light, radiosity, columns);
  const std::vector<float> field = multiply(rows, means, n, parts, columns);
  const double left = kRangeShare * kRangeShare * error * error * squares(field);
  basis = orthonormal_range(field, n, columns, left);
  coordinates = multiply_transposed(basis.q, rows, n, basis.rank, parts);
  if (gather.band4_rows) {
    gather.band4_rows(point, seen.end, rows.data());
    band4.reduce(rows, n, means, columns, left);
  }
}

void ProbeCluster::factorise(const SurfaceTransport& surfaces, const Measure& measure, const std::vector<float>& first,
                             double limit) {
  const std::size_t rank = basis.rank, rows = 3 * rank, sources = surfaces.sources(), parts = seen.lit.size();
  std::vector<float> transport(rows * parts, 0.0f);
  for (std::size_t c = 0; c < 3; ++c)
    surfaces.add_adjoint(static_cast<int>(c), coordinates, rank, seen,
                         std::span(transport).subspan(c * rank * parts, rank * parts));
  coordinates = {};
  SunMetric metric = seen.metric(measure.metric);
  scale_columns(transport, metric.sigma);
  scale_columns(projected, metric.sigma);
  for (std::size_t width = first.size() / sources;; width += width / 2) {
    const std::vector<float> more = width * sources == first.size() ? std::vector<float>{} : measure.suns(width);
    const std::vector<float> suns = seen.suns(metric, measure.metric, more.empty() ? first : more, width);
    if (more.empty())
      band4.factorise(surfaces, seen, metric, suns, width);
    factors = decompose(transport, rows, metric.correlation, suns, width);
    // Singular values fall like a power of their number: the tail is about as long as what was found.
    if (factors.rank() < width || factors.power.back() * static_cast<double>(width) <= limit)
      break;
  }
  factors.expand_rows(basis.q, coefficients());
  const std::vector<float> missed = factors.remainder(Factors::Taken::exactly, signs(), projected, kProjections);
  unseen = metric_trace(missed, metric.correlation, kProjections, parts) / kProjections;
  basis = {};
  own.sigma = std::move(metric.sigma);
}

std::vector<float> ProbeCluster::missed() const {
  std::vector<float> missed = factors.remainder(Factors::Taken::as_stored, signs(), projected, kProjections);
  for (std::size_t k = 0; k < missed.size(); ++k)
    missed[k] /= own.sigma[k % own.sigma.size()];
  return seen.expand(missed);
}

} // namespace daylit::precompute::detail
