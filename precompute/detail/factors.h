#pragma once

// Dense products and the factors of one probe cluster, row-major throughout.

#include <span>
#include <vector>

#include "precompute/detail/storage.h"
#include "scene/volume/compact_basis.h"

namespace daylit::precompute::detail {

/// [rows][wanted]: the first columns of a [rows][columns].
std::vector<float> first_columns(const std::vector<float>& a, std::size_t columns, std::size_t wanted);

/// [rows][columns] = a [rows][inner] b [inner][columns]
std::vector<float> multiply(std::span<const float> a, std::span<const float> b, std::size_t rows, std::size_t inner,
                            std::size_t columns);
/// [rows][columns] = a^T b with a [inner][rows], b [inner][columns]
std::vector<float> multiply_transposed(std::span<const float> a, std::span<const float> b, std::size_t inner,
                                       std::size_t rows, std::size_t columns);

/// The first of these into memory that exists.
void multiply_into(std::span<const float> a, std::span<const float> b, std::size_t rows, std::size_t inner,
                   std::size_t columns, std::span<float> c);
/// [rows][columns] = a b^T with a [rows][inner], b [columns][inner]
std::vector<float> multiply_by_transposed(std::span<const float> a, std::span<const float> b, std::size_t rows,
                                          std::size_t inner, std::size_t columns);
/// Trace of a M a^T in the metric M = sample sample^T; a is [rows][sources], the sample [sources][columns].
double metric_trace(std::span<const float> a, std::span<const float> sample, std::size_t rows, std::size_t sources);

/// Orthonormal columns: q is [rows][rank].
struct Basis {
  std::vector<float> q;
  std::size_t rank = 0;

  static Basis identity(std::size_t rows);
};
/// Of the range of `a` [rows][columns]; directions below 1e-5 of the strongest are dropped, and further ones as long as
/// the squares of all that are add up to no more than `left`.
Basis orthonormal_range(const std::vector<float>& a, std::size_t rows, std::size_t columns, double left = 0);

/// transport[row][source] = sum_k row_factor[k][row] source_factor[k][source], strongest component first. Sources are
/// in units of their metric: the irradiance of each has mean square 1.
struct Factors {
  std::size_t rows = 0, sources = 0;
  std::vector<double> power;        ///< of each component: squared norm in the metric
  std::vector<float> source_factor; ///< [component][source]
  std::vector<float> row_factor;    ///< [component][row], orthonormal; rows are [channel][coefficient]
  std::vector<Stored> stored;       ///< of each component

  std::size_t rank() const { return power.size(); }
  void keep(std::size_t rank);
  /// Squared error that each component takes from rounding both factors to 8 bits, under random suns [source][columns]:
  /// the roundings of neighbouring sources are alike where a factor is smooth, and a sun lights many of them.
  std::vector<double> weak_error2(std::span<const float> suns, std::size_t columns) const;
  /// Rows of another space: `basis` [coefficients][inner] orthonormal, rows are [channel][inner] before and
  /// [channel][coefficient] after.
  void expand_rows(const std::vector<float>& basis, std::size_t coefficients);
  /// Drops what is stored as nothing.
  void store_as(const std::vector<Stored>& choice);
  /// What the factors leave of `projected` [projection][source], the transport times random signs [row][projection].
  enum class Taken { exactly, as_stored };
  std::vector<float> remainder(Taken taken, std::span<const float> signs, std::span<const float> projected,
                               std::size_t projections) const;
};

/// Randomised singular value decomposition of `transport` [row][source] in the metric M = sample sample^T, sample
/// [source][columns], of at most `width` components (Halko, Martinsson, Tropp 2011, algorithm 4.4, one power iteration:
/// the singular values fall slowly, and the first sketch alone would miss half of them).
Factors decompose(const std::vector<float>& transport, std::size_t rows, std::span<const float> sample,
                  std::size_t width);

/// Rounds the factors of the last cluster of `out`, whose probes it knows already.
void append_factors(const Factors& factors, CompactFactors& out);

} // namespace daylit::precompute::detail
