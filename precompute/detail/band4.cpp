#include "precompute/detail/band4.h"

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

/// The first columns of each row.
std::vector<float> first_columns(const std::vector<float>& a, std::size_t columns, std::size_t wanted) {
  std::vector<float> out(a.size() / columns * wanted);
  for (std::size_t r = 0; r < a.size() / columns; ++r)
    std::copy_n(a.data() + r * columns, wanted, out.data() + r * wanted);
  return out;
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
                      const std::vector<float>& suns, std::size_t width) {
  const std::size_t rank = basis.rank, parts = seen.lit.size(), coefficients = rank > 0 ? basis.q.size() / rank : 0;
  if (rank == 0)
    return;
  std::vector<float> transport(3 * rank * parts, 0.0f);
  for (int c = 0; c < 3; ++c)
    surfaces.add_adjoint(c, coordinates, rank, seen,
                         std::span(transport).subspan(static_cast<std::size_t>(c) * rank * parts, rank * parts));
  for (std::size_t k = 0; k < transport.size(); ++k)
    transport[k] *= kWeight * metric.sigma[k % parts];
  const std::size_t few = fewer(width);
  factors = decompose(transport, 3 * rank, metric.correlation, first_columns(suns, width, few), few);
  factors.expand_rows(basis.q, coefficients);
  basis = {};
  coordinates = {};
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

} // namespace daylit::precompute::detail
