#include "precompute/detail/probe_cluster.h"

#include <algorithm>

namespace daylit::precompute::detail {

namespace {

/// Of an error here beside one of the nine. Irradiance takes these with a factor of 1.7 (root mean square of A_l over
/// the nine), so that |A_4| / 1.7 = 0.077 would weigh both alike in irradiance. The nine serve more than that.
constexpr float kWeight = 0.06f;
/// Of the columns that the sketches of the nine have: singular values that are worth keeping are so much fewer.
constexpr double kColumns = 0.13;
constexpr std::size_t kFewest = 16;

std::size_t fewer(std::size_t columns) {
  return std::min(columns, std::max(kFewest, static_cast<std::size_t>(kColumns * static_cast<double>(columns))));
}

constexpr std::size_t kFewRows = 2;  ///< times the columns of the sketch
constexpr double kRangeShare = 0.25; ///< of the allowed error: what the rows may lose before they are factorised

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

/// The range of the rows under fewer suns than the nine take; what may be left out is larger by 1 / kWeight^2.
void Band4::reduce(const std::vector<float>& rows, std::size_t coefficients, const std::vector<float>& radiosity,
                   std::size_t columns, double left) {
  const std::size_t parts = rows.size() / coefficients, few = fewer(columns);
  const std::vector<float> seen = multiply(rows, first_columns(radiosity, columns, few), coefficients, parts, few);
  const double fraction = static_cast<double>(few) / static_cast<double>(columns);
  basis = orthonormal_range(seen, coefficients, few, fraction * left / static_cast<double>(kWeight * kWeight));
  coordinates = multiply_transposed(basis.q, rows, coefficients, basis.rank, parts);
}

/// As for the nine, of kWeight times the transport.
void Band4::factorise(const SurfaceTransport& surfaces, const SeenParts& seen, const SunMetric& metric,
                      std::size_t width) {
  const std::size_t rank = basis.rank, parts = seen.lit.size(), coefficients = rank > 0 ? basis.q.size() / rank : 0;
  if (rank == 0)
    return;
  std::vector<float> transport(3 * rank * parts, 0.0f);
  for (int c = 0; c < 3; ++c)
    surfaces.add_adjoint(c, coordinates, rank, seen,
                         std::span(transport).subspan(static_cast<std::size_t>(c) * rank * parts, rank * parts));
  for (std::size_t k = 0; k < transport.size(); ++k)
    transport[k] *= kWeight * metric.sigma[k % parts];
  factors = decompose(transport, 3 * rank, metric.sample, fewer(width));
  factors.expand_rows(basis.q, coefficients);
  basis = {};
  coordinates = std::vector<float>(); // frees it: `= {}` would keep what it holds
}

void Band4::choose_storage(double per_byte, const std::vector<float>& suns, std::size_t columns) {
  const auto size = static_cast<double>(factors.sources + factors.rows);
  factors.keep(
      static_cast<std::size_t>(std::ranges::count_if(factors.power, [&](double p) { return p > per_byte * size; })));
  const std::vector<double> weak_error2 = factors.weak_error2(suns, columns);
  std::vector<Component> list;
  for (std::size_t k = 0; k < factors.rank(); ++k)
    list.push_back({factors.power[k], weak_error2[k], factors.sources + factors.rows});
  factors.store_as(cheapest_at(list, per_byte));
  for (float& x : factors.source_factor)
    x /= kWeight;
}

std::vector<float> Measure::suns(std::size_t count) const {
  std::vector<float> sun = columns.random_suns(weight, count);
  for (std::size_t k = 0; k < sun.size(); ++k)
    sun[k] /= metric.sigma[k / count];
  return sun;
}

/// [channel][coefficient][projection]
std::vector<float> ProbeCluster::signs() const { return random_signs(id + 16, 3 * coefficients() * kProjections); }

/// [channel][rank][projection]: basis^T signs, what a row factor r of the basis has to be multiplied with, as
/// (basis r)^T signs = r^T (basis^T signs).
std::vector<float> ProbeCluster::signs_in_basis() const {
  const std::size_t n = coefficients(), all = n * kProjections;
  const std::vector<float> sign = signs();
  std::vector<float> out;
  for (std::size_t c = 0; c < 3; ++c) {
    const auto one = multiply_transposed(basis.q, std::span(sign).subspan(c * all, all), n, basis.rank, kProjections);
    out.insert(out.end(), one.begin(), one.end());
  }
  return out;
}

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
  std::vector<Sight> sight(light.patches, Sight::none);
  gather.sight(point, sight);
  seen = SeenParts::of(light, light.fraction_for(id), sight);
  const std::size_t parts = seen.part.size();
  std::vector<float> rows(n * parts);
  gather.rows(point, seen.end, rows.data());
  project(surfaces, rows);
  const std::vector<float> means = seen.means(light, radiosity, columns);
  const std::vector<float> field = multiply(rows, means, n, parts, columns);
  power = squares(field) / static_cast<double>(field.size());
  const double left = kRangeShare * kRangeShare * error * error * squares(field);
  // A few points far apart have nothing in common that a sketch could find.
  basis = n <= kFewRows * columns ? Basis::identity(n) : orthonormal_range(field, n, columns, left);
  coordinates = multiply_transposed(basis.q, rows, n, basis.rank, parts);
  if (gather.band4_rows) {
    gather.band4_rows(point, seen.end, rows.data());
    band4.reduce(rows, n, means, columns, left);
  }
}

void ProbeCluster::set_gain(float value) {
  gain = value;
  for (std::vector<float>* list : {&projected, &coordinates, &band4.coordinates})
    for (float& x : *list)
      x *= gain;
}

void ProbeCluster::take_gain_off() {
  for (std::vector<float>* list : {&projected, &factors.source_factor, &band4.factors.source_factor})
    for (float& x : *list)
      x /= gain;
}

void ProbeCluster::factorise(const SurfaceTransport& surfaces, const SunMetric& of_sources, std::size_t width,
                             double limit) {
  const std::size_t rank = basis.rank, rows = 3 * rank, parts = seen.lit.size();
  std::vector<float> transport(rows * parts, 0.0f);
  for (std::size_t c = 0; c < 3; ++c)
    surfaces.add_adjoint(static_cast<int>(c), coordinates, rank, seen,
                         std::span(transport).subspan(c * rank * parts, rank * parts));
  coordinates = std::vector<float>();
  SunMetric metric = seen.metric(of_sources);
  scale_columns(transport, metric.sigma);
  scale_columns(projected, metric.sigma);
  band4.factorise(surfaces, seen, metric, width);
  // Singular values fall like a power of their number: the tail is about as long as what was found.
  for (;; width += width / 2) {
    factors = decompose(transport, rows, metric.sample, width);
    if (factors.rank() < width || factors.power.back() * static_cast<double>(width) <= limit)
      break;
  }
  const std::vector<float> missed =
      factors.remainder(Factors::Taken::exactly, signs_in_basis(), projected, kProjections);
  unseen = metric_trace(missed, metric.sample, kProjections, parts) / kProjections;
  own.sigma = std::move(metric.sigma);
}

void ProbeCluster::expand() {
  factors.expand_rows(basis.q, coefficients());
  basis = {};
}

std::vector<float> ProbeCluster::missed() const {
  std::vector<float> missed = factors.remainder(Factors::Taken::as_stored, signs(), projected, kProjections);
  for (std::size_t k = 0; k < missed.size(); ++k)
    missed[k] /= own.sigma[k % own.sigma.size()];
  return seen.expand(missed);
}

} // namespace daylit::precompute::detail
