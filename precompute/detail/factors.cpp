#include "precompute/detail/factors.h"

#include <algorithm>
#include <cmath>

#include <cblas.h>

#include "scene/core/parallel.h"

// LAPACK, part of OpenBLAS: eigenvalues and eigenvectors of a symmetric matrix.
extern "C" void dsyevd_(const char* jobz, const char* uplo, const int* n, double* a, const int* lda, double* w,
                        double* work, const int* lwork, int* iwork, const int* liwork, int* info);

namespace daylit::precompute::detail {

namespace {

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

std::span<const float> row_of(const std::vector<float>& a, std::size_t k, std::size_t length) {
  return std::span(a).subspan(k * length, length);
}

} // namespace

std::vector<float> first_columns(const std::vector<float>& a, std::size_t columns, std::size_t wanted) {
  std::vector<float> out(columns > 0 ? a.size() / columns * wanted : 0);
  for (std::size_t r = 0; r * wanted < out.size(); ++r)
    std::copy_n(a.data() + r * columns, wanted, out.data() + r * wanted);
  return out;
}

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

/// |a sample|^2
double metric_trace(std::span<const float> a, std::span<const float> sample, std::size_t rows, std::size_t sources) {
  double sum = 0;
  for (const float x : multiply(a, sample, rows, sources, sources > 0 ? sample.size() / sources : 0))
    sum += static_cast<double>(x) * static_cast<double>(x);
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

/// q_ij = 1 where i = j, else 0.
Basis Basis::identity(std::size_t rows) {
  Basis basis{std::vector<float>(rows * rows, 0.0f), rows};
  for (std::size_t k = 0; k < rows; ++k)
    basis.q[k * rows + k] = 1.0f;
  return basis;
}

/// With a^T a = V diag(s^2) V^T the columns of a V / s are orthonormal; the squares that a direction takes along when
/// it is dropped are s^2.
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

namespace {

/// Of at most `width` columns, with one power iteration: q = orth(A A^T orth(A_w)), A_w the first columns of A.
Basis strongest_range(const std::vector<float>& a, std::size_t rows, std::size_t columns, std::size_t width) {
  const Basis first = orthonormal_range(first_columns(a, columns, width), rows, width);
  if (first.rank == 0)
    return first;
  const std::vector<float> seen = multiply_transposed(first.q, a, rows, first.rank, columns);
  return orthonormal_range(multiply_by_transposed(a, seen, rows, columns, first.rank), rows, first.rank);
}

} // namespace

/// A = transport sample. With its range q and q^T A A^T q = U diag(power) U^T the rows of U^T q^T are the row factors,
/// and their products with the transport the source factors: the singular value decomposition of the block in the
/// metric.
Factors decompose(const std::vector<float>& transport, std::size_t rows, std::span<const float> sample,
                  std::size_t width) {
  Factors f;
  f.rows = rows;
  f.sources = rows > 0 ? transport.size() / rows : 0;
  const std::size_t columns = f.sources > 0 ? sample.size() / f.sources : 0;
  const std::vector<float> seen = multiply(transport, sample, rows, f.sources, columns);
  const Basis range = strongest_range(seen, rows, columns, std::min(width, columns));
  const std::size_t n = range.rank;
  const std::vector<float> coordinates = multiply_transposed(range.q, seen, rows, n, columns),
                           product = multiply_by_transposed(coordinates, coordinates, n, columns, n);
  std::vector<double> values;
  const std::vector<double> vectors = eigenvectors(std::vector<double>(product.begin(), product.end()), n, values);
  std::vector<float> turn(n * n); // row k: component k, strongest first
  for (std::size_t k = 0; k < n; ++k) {
    f.power.push_back(std::max(values[n - 1 - k], 0.0));
    for (std::size_t i = 0; i < n; ++i)
      turn[k * n + i] = static_cast<float>(vectors[(n - 1 - k) * n + i]);
  }
  f.row_factor = multiply_by_transposed(turn, range.q, n, n, rows);
  f.source_factor = multiply(f.row_factor, transport, n, rows, f.sources);
  f.stored.assign(n, Stored::strong);
  return f;
}

void Factors::keep(std::size_t rank) {
  power.resize(rank);
  stored.resize(rank);
  source_factor.resize(rank * sources);
  row_factor.resize(rank * rows);
  source_factor.shrink_to_fit();
  row_factor.shrink_to_fit();
}

/// power * (relative error of the row factor)^2 + mean over the suns of (rounding error of the source factor * sun)^2.
std::vector<double> Factors::weak_error2(std::span<const float> suns, std::size_t columns) const {
  std::vector<float> off = source_factor;
  std::vector<double> error(rank());
  for (std::size_t k = 0; k < rank(); ++k) {
    const std::vector<float> kept = Rounded::source_factor(row_of(source_factor, k, sources), Stored::weak).values();
    for (std::size_t s = 0; s < sources; ++s)
      off[k * sources + s] -= kept[s];
    error[k] = power[k] * row_rounding2(row_of(row_factor, k, rows));
  }
  const std::vector<float> seen = multiply(off, suns, rank(), sources, columns);
  for (std::size_t k = 0; k < rank(); ++k)
    for (const float x : row_of(seen, k, columns))
      error[k] += static_cast<double>(x) * static_cast<double>(x) / static_cast<double>(columns);
  return error;
}

void Factors::expand_rows(const std::vector<float>& basis, std::size_t coefficients) {
  const std::size_t inner = rows / 3;
  std::vector<float> wide(rank() * 3 * coefficients);
  // [component, colour][inner] times the transpose: components and colours are one index.
  if (rank() > 0)
    wide = multiply_by_transposed(row_factor, basis, rank() * 3, inner, coefficients);
  row_factor = std::move(wide);
  rows = 3 * coefficients;
}

void Factors::store_as(const std::vector<Stored>& choice) {
  std::size_t kept = 0;
  for (std::size_t k = 0; k < rank(); ++k) {
    if (choice[k] == Stored::nothing)
      continue;
    stored[kept] = choice[k];
    power[kept] = power[k];
    std::ranges::copy(row_of(source_factor, k, sources), source_factor.begin() + std::ptrdiff_t(kept * sources));
    std::ranges::copy(row_of(row_factor, k, rows), row_factor.begin() + std::ptrdiff_t(kept * rows));
    ++kept;
  }
  keep(kept);
}

/// signs^T transport - (signs^T row_factor^T) source_factor
std::vector<float> Factors::remainder(Taken taken, std::span<const float> signs, std::span<const float> projected,
                                      std::size_t projections) const {
  std::vector<float> source = source_factor, row = row_factor;
  for (std::size_t k = 0; taken == Taken::as_stored && k < rank(); ++k) {
    std::ranges::copy(Rounded::source_factor(row_of(source_factor, k, sources), stored[k]).values(),
                      source.begin() + std::ptrdiff_t(k * sources));
    std::ranges::copy(Rounded::row_factor(row_of(row_factor, k, rows), stored[k]).values(),
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

namespace {

/// Components of one type of a cluster to the end of them: the steps of both factors become one scale. How many.
template <class T>
std::uint32_t append_components(const Factors& f, Stored type, Components<T>& out) {
  std::vector<std::size_t> of_type;
  for (std::size_t k = 0; k < f.rank(); ++k)
    if (f.stored[k] == type)
      of_type.push_back(k);
  const std::size_t count = of_type.size(), first = out.scale.size(), first_source = out.source_factor.size(),
                    first_row = out.probe_factor.size();
  out.scale.resize(first + count);
  out.source_factor.resize(first_source + count * f.sources);
  out.probe_factor.resize(first_row + count * f.rows);
  parallel_for(std::size_t{0}, count, [&](std::size_t n) {
    const std::size_t k = of_type[n];
    const Rounded source = Rounded::source_factor(row_of(f.source_factor, k, f.sources), type),
                  row = Rounded::row_factor(row_of(f.row_factor, k, f.rows), type);
    out.scale[first + n] = source.step * row.step;
    std::ranges::transform(source.integer, out.source_factor.begin() + std::ptrdiff_t(first_source + n * f.sources),
                           [](std::int16_t x) { return static_cast<T>(x); });
    T* to = &out.probe_factor[first_row + n * f.rows];
    for (std::size_t i = 0; i < f.rows / 3; ++i) // from [channel][coefficient] to [coefficient][channel]
      for (std::size_t c = 0; c < 3; ++c)
        *to++ = static_cast<T>(row.integer[c * (f.rows / 3) + i]);
  });
  return static_cast<std::uint32_t>(count);
}

} // namespace

void append_factors(const Factors& f, CompactFactors& out) {
  CompactFactors::Cluster& cluster = out.cluster.back();
  cluster.sources = f.rank() > 0 ? static_cast<std::uint32_t>(f.sources) : 0;
  cluster.strong = append_components(f, Stored::strong, out.strong);
  cluster.weak = append_components(f, Stored::weak, out.weak);
}

} // namespace daylit::precompute::detail
