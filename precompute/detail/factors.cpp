#include "precompute/detail/factors.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <cblas.h>

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
float scale_of(std::span<const float> row) {
  const float most = largest(row);
  return most > 0 ? most : 1.0f;
}

/// What remains of a row after it was stored.
std::vector<float> rounded(std::span<const float> row, bool half) {
  const float scale = scale_of(row);
  std::vector<float> out(row.size());
  for (std::size_t k = 0; k < row.size(); ++k)
    out[k] = half ? scale * daylit::detail::from_half(daylit::detail::to_half(row[k] / scale))
                  : scale / 127.0f * static_cast<float>(to_byte(row[k] / scale));
  return out;
}

} // namespace

std::vector<float> multiply(std::span<const float> a, std::span<const float> b, std::size_t rows, std::size_t inner,
                            std::size_t columns) {
  std::vector<float> c(rows * columns);
  cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, static_cast<int>(rows), static_cast<int>(columns),
              static_cast<int>(inner), 1.0f, a.data(), static_cast<int>(inner), b.data(), static_cast<int>(columns),
              0.0f, c.data(), static_cast<int>(columns));
  return c;
}

std::vector<float> multiply_transposed(std::span<const float> a, std::span<const float> b, std::size_t inner,
                                       std::size_t rows, std::size_t columns) {
  std::vector<float> c(rows * columns);
  cblas_sgemm(CblasRowMajor, CblasTrans, CblasNoTrans, static_cast<int>(rows), static_cast<int>(columns),
              static_cast<int>(inner), 1.0f, a.data(), static_cast<int>(rows), b.data(), static_cast<int>(columns),
              0.0f, c.data(), static_cast<int>(columns));
  return c;
}

Basis orthonormal_range(const std::vector<float>& a, std::size_t rows, std::size_t columns) {
  const std::vector<float> t = transposed(a, rows, columns);
  std::vector<double> values;
  const std::vector<double> vectors =
      eigenvectors(gram(std::vector<double>(t.begin(), t.end()), columns, rows), columns, values);
  const double most = values.empty() ? 0.0 : values.back();
  Basis basis;
  std::vector<float> map; // [rank][columns]
  for (std::size_t k = 0; k < columns; ++k)
    if (values[k] > 1e-10 * most && most > 0) {
      ++basis.rank;
      for (std::size_t i = 0; i < columns; ++i)
        map.push_back(static_cast<float>(vectors[k * columns + i] / std::sqrt(values[k])));
    }
  basis.q = basis.rank > 0 ? multiply(a, transposed(map, basis.rank, columns), rows, columns, basis.rank)
                           : std::vector<float>{};
  return basis;
}

Factors factorise(const Basis& range, std::size_t rows, std::vector<float> coordinates, std::size_t nodes) {
  Factors f;
  f.rows = rows;
  f.nodes = nodes;
  const std::size_t n = range.rank;
  if (n == 0)
    return f;
  std::vector<double> values;
  const std::vector<double> vectors =
      eigenvectors(gram(std::vector<double>(coordinates.begin(), coordinates.end()), n, f.nodes), n, values);
  std::vector<float> turn(n * n); // row k: component k, strongest first
  for (std::size_t k = 0; k < n; ++k) {
    f.power.push_back(std::max(values[n - 1 - k], 0.0));
    for (std::size_t i = 0; i < n; ++i)
      turn[k * n + i] = static_cast<float>(vectors[(n - 1 - k) * n + i]);
  }
  f.node_factor = multiply(turn, coordinates, n, n, f.nodes);
  f.row_factor = multiply(turn, transposed(range.q, rows, n), n, n, rows);
  f.half.assign(n, 0);
  return f;
}

void Factors::keep(std::size_t rank) {
  power.resize(rank);
  half.resize(rank);
  node_factor.resize(rank * nodes);
  row_factor.resize(rank * rows);
  node_factor.shrink_to_fit();
  row_factor.shrink_to_fit();
}

std::vector<double> Factors::byte_error2() const {
  std::vector<double> error(rank());
  for (std::size_t k = 0; k < rank(); ++k)
    error[k] = power[k] * (byte_rounding2(row_of(node_factor, k, nodes)) + byte_rounding2(row_of(row_factor, k, rows)));
  return error;
}

void Factors::mark_halves(double byte_error2_limit) {
  const std::vector<double> error = byte_error2();
  std::vector<std::size_t> order(rank());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_partition(order, [&](std::size_t k) { return error[k] > byte_error2_limit; });
  Factors sorted = *this;
  for (std::size_t k = 0; k < rank(); ++k) {
    sorted.half[k] = error[order[k]] > byte_error2_limit ? 1 : 0;
    sorted.power[k] = power[order[k]];
    std::ranges::copy(row_of(node_factor, order[k], nodes), sorted.node_factor.begin() + std::ptrdiff_t(k * nodes));
    std::ranges::copy(row_of(row_factor, order[k], rows), sorted.row_factor.begin() + std::ptrdiff_t(k * rows));
  }
  *this = std::move(sorted);
}

void Factors::add_error2(Stored stored, std::span<const float> signs, std::span<const float> projected,
                         std::size_t projections, std::vector<double>& error2) const {
  std::vector<float> node = node_factor, row = row_factor;
  for (std::size_t k = 0; stored == Stored::rounded && k < rank(); ++k) {
    std::ranges::copy(rounded(row_of(node_factor, k, nodes), half[k] != 0), node.begin() + std::ptrdiff_t(k * nodes));
    std::ranges::copy(rounded(row_of(row_factor, k, rows), half[k] != 0), row.begin() + std::ptrdiff_t(k * rows));
  }
  std::vector<float> given(projections * nodes, 0.0f);
  if (rank() > 0) {
    const std::vector<float> seen = transposed(multiply(row, signs, rank(), rows, projections), rank(), projections);
    given = multiply(seen, node, projections, rank(), nodes);
  }
  for (std::size_t k = 0; k < given.size(); ++k) {
    const double d = static_cast<double>(projected[k]) - static_cast<double>(given[k]);
    error2[k % nodes] += d * d / static_cast<double>(projections);
  }
}

void store_factors(std::span<const Factors* const> bricks, CompactBasis& basis) {
  const std::size_t nodes = basis.node.size();
  std::size_t halves = 0, bytes = 0;
  for (std::size_t b = 0; b < bricks.size(); ++b) {
    const auto count = static_cast<std::uint32_t>(std::ranges::count(bricks[b]->half, 1));
    basis.brick[b].half_rank = count;
    basis.brick[b].byte_rank = static_cast<std::uint32_t>(bricks[b]->rank()) - count;
    halves += count;
    bytes += basis.brick[b].byte_rank;
  }
  const auto tiles = [](std::size_t n) { return (n + kTileNumbers - 1) / kTileNumbers; };
  basis.node_half.assign(tiles(halves) * nodes * kTileNumbers, 0);
  basis.node_byte.assign(tiles(bytes) * nodes * kTileNumbers, 0);
  for (std::size_t b = 0; b < bricks.size(); ++b) {
    const Factors& f = *bricks[b];
    const std::size_t brick_tiles = basis.brick[b].tiles(), half_rank = basis.brick[b].half_rank,
                      byte_rank = basis.brick[b].byte_rank, half_at = basis.probe_half.size(),
                      byte_at = basis.probe_byte.size();
    basis.probe_half.resize(half_at + 3 * brick_tiles * half_rank * kTileNumbers, 0);
    basis.probe_byte.resize(byte_at + 3 * brick_tiles * byte_rank * kTileNumbers, 0);
    for (std::size_t k = 0; k < f.rank(); ++k) {
      const bool half = f.half[k] != 0;
      const std::span<const float> node = row_of(f.node_factor, k, nodes), row = row_of(f.row_factor, k, f.rows);
      const float node_scale = scale_of(node), row_scale = scale_of(row);
      const std::size_t component = half ? basis.half_scale.size() : basis.byte_scale.size();
      for (std::size_t i = 0; i < nodes; ++i) {
        const std::size_t at = (component / kTileNumbers * nodes + i) * kTileNumbers + component % kTileNumbers;
        if (half)
          basis.node_half[at] = daylit::detail::to_half(node[i] / node_scale);
        else
          basis.node_byte[at] = to_byte(node[i] / node_scale);
      }
      for (std::size_t i = 0; i < f.rows; ++i) { // row = (probe * 9 + lm) * 3 + channel
        const std::size_t number = i / 3, tile = i % 3 * brick_tiles + number / kTileNumbers;
        if (half)
          basis.probe_half[half_at + (tile * half_rank + k) * kTileNumbers + number % kTileNumbers] =
              daylit::detail::to_half(row[i] / row_scale);
        else
          basis.probe_byte[byte_at + (tile * byte_rank + k - half_rank) * kTileNumbers + number % kTileNumbers] =
              to_byte(row[i] / row_scale);
      }
      (half ? basis.half_scale : basis.byte_scale)
          .push_back(half ? node_scale * row_scale : node_scale * row_scale / (127.0f * 127.0f));
    }
  }
}

} // namespace daylit::precompute::detail
