#include "precompute/detail/factors.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <cblas.h>

#include "radiosity/detail/sampling.h"
#include "scene/detail/tile_kernels.h"

// LAPACK, part of OpenBLAS: eigenvalues and eigenvectors of a symmetric matrix.
extern "C" void dsyevd_(const char* jobz, const char* uplo, const int* n, double* a, const int* lda, double* w,
                        double* work, const int* lwork, int* iwork, const int* liwork, int* info);

namespace daylit::precompute::detail {

namespace {

using daylit::detail::kTileNumbers;

/// Ascending eigenvalues; row k of the returned matrix is eigenvector k.
std::vector<double> eigenvectors(std::vector<double> a, std::size_t n, std::vector<double>& values) {
  values.assign(n, 0.0);
  const int size = static_cast<int>(n), work_size = 1 + 6 * size + 2 * size * size, index_size = 3 + 5 * size;
  std::vector<double> work(static_cast<std::size_t>(work_size));
  std::vector<int> index(static_cast<std::size_t>(index_size));
  int info = 0;
  if (n > 0)
    dsyevd_("V", "U", &size, a.data(), &size, values.data(), work.data(), &work_size, index.data(), &index_size, &info);
  if (info != 0)
    std::ranges::fill(values, 0.0); // no component is usable: the error estimate then says so
  return a;
}

/// a a^T in double, a is [rows][columns].
std::vector<double> gram(const std::vector<double>& a, std::size_t rows, std::size_t columns) {
  std::vector<double> g(rows * rows, 0.0);
  const int n = static_cast<int>(rows), k = static_cast<int>(columns);
  cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasTrans, n, n, k, 1.0, a.data(), k, a.data(), k, 0.0, g.data(), n);
  return g;
}

std::vector<float> transposed(std::span<const float> a, std::size_t rows, std::size_t columns) {
  std::vector<float> t(a.size());
  for (std::size_t r = 0; r < rows; ++r)
    for (std::size_t c = 0; c < columns; ++c)
      t[c * rows + r] = a[r * columns + c];
  return t;
}

float largest(std::span<const float> row) {
  float most = 0;
  for (const float x : row)
    most = std::max(most, std::abs(x));
  return most;
}

std::span<const float> row_of(const std::vector<float>& a, std::size_t k, std::size_t length) {
  return std::span(a).subspan(k * length, length);
}

/// Mean square of the rounding to bytes, relative to the mean square of the numbers.
double byte_rounding2(std::span<const float> row) {
  double sum = 0;
  for (const float x : row)
    sum += static_cast<double>(x) * static_cast<double>(x);
  const double step = static_cast<double>(largest(row)) / 127;
  return sum > 0 ? step * step / 12 / (sum / static_cast<double>(row.size())) : 0;
}

std::int8_t to_byte(float unit) { return static_cast<std::int8_t>(std::lround(127.0f * unit)); }
/// Rounded up or down by chance, right in the mean: number k of a row that is smooth, of which a sun takes many
/// neighbours at once. Plain rounding would be off by the same amount in all of them. Nothing stays nothing: no light
/// comes from the other side of a wall.
std::int8_t to_byte_dithered(float unit, std::size_t k) {
  if (unit == 0.0f)
    return 0;
  const double chance = radiosity::unit_interval(radiosity::mix_bits(k)) - 0.5;
  return static_cast<std::int8_t>(std::clamp(std::lround(127.0 * static_cast<double>(unit) + chance), -127l, 127l));
}
float scale_of(std::span<const float> row) {
  const float most = largest(row);
  return most > 0 ? most : 1.0f;
}

/// What remains of a row after it was stored.
std::vector<float> rounded(std::span<const float> row, bool half, bool dithered) {
  const float scale = scale_of(row);
  std::vector<float> out(row.size());
  for (std::size_t k = 0; k < row.size(); ++k) {
    const float unit = row[k] / scale;
    out[k] = half ? scale * daylit::detail::from_half(daylit::detail::to_half(unit))
                  : scale / 127.0f * static_cast<float>(dithered ? to_byte_dithered(unit, k) : to_byte(unit));
  }
  return out;
}

} // namespace

void multiply_into(std::span<const float> a, std::span<const float> b, std::size_t rows, std::size_t inner,
                   std::size_t columns, std::span<float> c) {
  cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, static_cast<int>(rows), static_cast<int>(columns),
              static_cast<int>(inner), 1.0f, a.data(), static_cast<int>(inner), b.data(), static_cast<int>(columns),
              0.0f, c.data(), static_cast<int>(columns));
}

std::vector<float> multiply(std::span<const float> a, std::span<const float> b, std::size_t rows, std::size_t inner,
                            std::size_t columns) {
  std::vector<float> c(rows * columns);
  multiply_into(a, b, rows, inner, columns, c);
  return c;
}

std::vector<float> multiply_by_transposed(std::span<const float> a, std::span<const float> b, std::size_t rows,
                                          std::size_t inner, std::size_t columns) {
  std::vector<float> c(rows * columns);
  cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasTrans, static_cast<int>(rows), static_cast<int>(columns),
              static_cast<int>(inner), 1.0f, a.data(), static_cast<int>(inner), b.data(), static_cast<int>(inner), 0.0f,
              c.data(), static_cast<int>(columns));
  return c;
}

double metric_trace(std::span<const float> a, std::span<const float> metric, std::size_t rows, std::size_t columns) {
  const std::vector<float> seen = multiply(a, metric, rows, columns, columns);
  double sum = 0;
  for (std::size_t k = 0; k < seen.size(); ++k)
    sum += static_cast<double>(seen[k]) * static_cast<double>(a[k]);
  return sum;
}

std::vector<float> multiply_transposed(std::span<const float> a, std::span<const float> b, std::size_t inner,
                                       std::size_t rows, std::size_t columns) {
  std::vector<float> c(rows * columns);
  cblas_sgemm(CblasRowMajor, CblasTrans, CblasNoTrans, static_cast<int>(rows), static_cast<int>(columns),
              static_cast<int>(inner), 1.0f, a.data(), static_cast<int>(rows), b.data(), static_cast<int>(columns),
              0.0f, c.data(), static_cast<int>(columns));
  return c;
}

Basis orthonormal_range(const std::vector<float>& a, std::size_t rows, std::size_t columns, double left) {
  const std::vector<float> t = transposed(a, rows, columns);
  std::vector<double> values;
  const std::vector<double> vectors =
      eigenvectors(gram(std::vector<double>(t.begin(), t.end()), columns, rows), columns, values);
  const double most = values.empty() ? 0.0 : values.back();
  Basis basis;
  std::vector<float> map; // [rank][columns]
  double dropped = 0;     // ascending
  for (std::size_t k = 0; k < columns; ++k)
    if (dropped += std::max(values[k], 0.0); dropped > left && values[k] > 1e-10 * most && most > 0) {
      ++basis.rank;
      for (std::size_t i = 0; i < columns; ++i)
        map.push_back(static_cast<float>(vectors[k * columns + i] / std::sqrt(values[k])));
    }
  basis.q = basis.rank > 0 ? multiply(a, transposed(map, basis.rank, columns), rows, columns, basis.rank)
                           : std::vector<float>{};
  return basis;
}

Factors factorise(const Basis& range, std::size_t rows, std::vector<float> coordinates, std::size_t sources,
                  std::span<const float> metric) {
  Factors f;
  f.rows = rows;
  f.sources = sources;
  const std::size_t n = range.rank;
  if (n == 0)
    return f;
  std::vector<double> values;
  const std::vector<float> seen = multiply(coordinates, metric, n, sources, sources);
  const std::vector<float> product = multiply_by_transposed(coordinates, seen, n, sources, n);
  const std::vector<double> vectors = eigenvectors(std::vector<double>(product.begin(), product.end()), n, values);
  std::vector<float> turn(n * n); // row k: component k, strongest first
  for (std::size_t k = 0; k < n; ++k) {
    f.power.push_back(std::max(values[n - 1 - k], 0.0));
    for (std::size_t i = 0; i < n; ++i)
      turn[k * n + i] = static_cast<float>(vectors[(n - 1 - k) * n + i]);
  }
  f.source_factor = multiply(turn, coordinates, n, n, sources);
  f.row_factor = multiply(turn, transposed(range.q, rows, n), n, n, rows);
  f.half.assign(n, 0);
  return f;
}

void Factors::keep(std::size_t rank) {
  power.resize(rank);
  half.resize(rank);
  source_factor.resize(rank * sources);
  row_factor.resize(rank * rows);
  source_factor.shrink_to_fit();
  row_factor.shrink_to_fit();
}

std::vector<double> Factors::byte_error2(std::span<const float> suns, std::size_t columns) const {
  std::vector<float> off = source_factor;
  for (std::size_t k = 0; k < rank(); ++k) {
    const std::vector<float> kept = rounded(row_of(source_factor, k, sources), false, true);
    for (std::size_t s = 0; s < sources; ++s)
      off[k * sources + s] -= kept[s];
  }
  const std::vector<float> seen = multiply(off, suns, rank(), sources, columns);
  std::vector<double> error(rank());
  for (std::size_t k = 0; k < rank(); ++k) {
    error[k] = power[k] * byte_rounding2(row_of(row_factor, k, rows));
    for (const float x : row_of(seen, k, columns))
      error[k] += static_cast<double>(x) * static_cast<double>(x) / static_cast<double>(columns);
  }
  return error;
}

void Factors::expand_rows(const std::vector<float>& basis, std::size_t numbers) {
  const std::size_t inner = rows / 3;
  std::vector<float> wide(rank() * 3 * numbers);
  // [component, colour][inner] times the transpose: components and colours are one index.
  if (rank() > 0)
    wide = multiply_by_transposed(row_factor, basis, rank() * 3, inner, numbers);
  row_factor = std::move(wide);
  rows = 3 * numbers;
}

void Factors::mark_halves(const std::vector<double>& error, double byte_error2_limit) {
  std::vector<std::size_t> order(rank());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_partition(order, [&](std::size_t k) { return error[k] > byte_error2_limit; });
  Factors sorted = *this;
  for (std::size_t k = 0; k < rank(); ++k) {
    sorted.half[k] = error[order[k]] > byte_error2_limit ? 1 : 0;
    sorted.power[k] = power[order[k]];
    std::ranges::copy(row_of(source_factor, order[k], sources),
                      sorted.source_factor.begin() + std::ptrdiff_t(k * sources));
    std::ranges::copy(row_of(row_factor, order[k], rows), sorted.row_factor.begin() + std::ptrdiff_t(k * rows));
  }
  *this = std::move(sorted);
}

std::vector<float> Factors::remainder(Stored stored, std::span<const float> signs, std::span<const float> projected,
                                      std::size_t projections) const {
  std::vector<float> source = source_factor, row = row_factor;
  for (std::size_t k = 0; stored == Stored::rounded && k < rank(); ++k) {
    std::ranges::copy(rounded(row_of(source_factor, k, sources), half[k] != 0, true),
                      source.begin() + std::ptrdiff_t(k * sources));
    std::ranges::copy(rounded(row_of(row_factor, k, rows), half[k] != 0, false),
                      row.begin() + std::ptrdiff_t(k * rows));
  }
  std::vector<float> left(projected.begin(), projected.end());
  if (rank() == 0)
    return left;
  const std::vector<float> seen = transposed(multiply(row, signs, rank(), rows, projections), rank(), projections);
  const std::vector<float> given = multiply(seen, source, projections, rank(), sources);
  for (std::size_t k = 0; k < left.size(); ++k)
    left[k] -= given[k];
  return left;
}

void store_factors(std::span<const Factors* const> bricks, CompactBasis& basis) {
  const std::size_t sources = basis.sources;
  std::size_t halves = 0, bytes = 0;
  for (std::size_t b = 0; b < bricks.size(); ++b) {
    const auto count = static_cast<std::uint32_t>(std::ranges::count(bricks[b]->half, 1));
    basis.brick[b].half_rank = count;
    basis.brick[b].byte_rank = static_cast<std::uint32_t>(bricks[b]->rank()) - count;
    halves += count;
    bytes += basis.brick[b].byte_rank;
  }
  const auto tiles = [](std::size_t n) { return (n + kTileNumbers - 1) / kTileNumbers; };
  basis.source_half.assign(tiles(halves) * sources * kTileNumbers, 0);
  basis.source_byte.assign(tiles(bytes) * sources * kTileNumbers, 0);
  for (std::size_t b = 0; b < bricks.size(); ++b) {
    const Factors& f = *bricks[b];
    const std::size_t brick_tiles = basis.brick[b].tiles(), half_rank = basis.brick[b].half_rank,
                      byte_rank = basis.brick[b].byte_rank, half_at = basis.probe_half.size(),
                      byte_at = basis.probe_byte.size();
    basis.probe_half.resize(half_at + 3 * brick_tiles * half_rank * kTileNumbers, 0);
    basis.probe_byte.resize(byte_at + 3 * brick_tiles * byte_rank * kTileNumbers, 0);
    for (std::size_t k = 0; k < f.rank(); ++k) {
      const bool half = f.half[k] != 0;
      const std::span<const float> source = row_of(f.source_factor, k, sources), row = row_of(f.row_factor, k, f.rows);
      const float source_scale = scale_of(source), row_scale = scale_of(row);
      const std::size_t component = half ? basis.half_scale.size() : basis.byte_scale.size();
      for (std::size_t i = 0; i < sources; ++i) {
        const std::size_t at = (component / kTileNumbers * sources + i) * kTileNumbers + component % kTileNumbers;
        if (half)
          basis.source_half[at] = daylit::detail::to_half(source[i] / source_scale);
        else
          basis.source_byte[at] = to_byte_dithered(source[i] / source_scale, i);
      }
      const std::size_t numbers = f.rows / 3;
      for (std::size_t i = 0; i < f.rows; ++i) {
        const std::size_t number = i % numbers, tile = i / numbers * brick_tiles + number / kTileNumbers;
        if (half)
          basis.probe_half[half_at + (tile * half_rank + k) * kTileNumbers + number % kTileNumbers] =
              daylit::detail::to_half(row[i] / row_scale);
        else
          basis.probe_byte[byte_at + (tile * byte_rank + k - half_rank) * kTileNumbers + number % kTileNumbers] =
              to_byte(row[i] / row_scale);
      }
      (half ? basis.half_scale : basis.byte_scale)
          .push_back(half ? source_scale * row_scale : source_scale * row_scale / (127.0f * 127.0f));
    }
  }
}

} // namespace daylit::precompute::detail
