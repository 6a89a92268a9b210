#pragma once

// Dense products and the factors of one brick, row-major throughout.

#include <cstdint>
#include <span>
#include <vector>

#include "scene/compact_basis.h"

namespace daylit::precompute::detail {

/// [rows][columns] = a [rows][inner] b [inner][columns]
std::vector<float> multiply(std::span<const float> a, std::span<const float> b, std::size_t rows, std::size_t inner,
                            std::size_t columns);
/// [rows][columns] = a^T b with a [inner][rows], b [inner][columns]
std::vector<float> multiply_transposed(std::span<const float> a, std::span<const float> b, std::size_t inner,
                                       std::size_t rows, std::size_t columns);

/// Orthonormal columns: q is [rows][rank].
struct Basis {
  std::vector<float> q;
  std::size_t rank = 0;
};
/// Of the range of `a` [rows][columns]; directions below 1e-5 of the strongest are dropped.
Basis orthonormal_range(const std::vector<float>& a, std::size_t rows, std::size_t columns);

/// basis[node][row] = sum_k node_factor[k][node] row_factor[row][k], strongest component first.
struct Factors {
  std::size_t rows = 0, nodes = 0;
  std::vector<double> power;      ///< of each component: squared norm
  std::vector<float> node_factor; ///< [component][node]
  std::vector<float> row_factor;  ///< [component][row], orthonormal
  std::vector<std::uint8_t> half; ///< 1: kept as half floats, else as bytes

  std::size_t rank() const { return power.size(); }
  void keep(std::size_t rank);
  /// Squared error that each component would take from rounding both factors to bytes: uniform rounding of width
  /// max / 127, relative to the mean square of each factor.
  std::vector<double> byte_error2() const;
  /// Components whose error is above the limit become half floats, and come first.
  void mark_halves(double byte_error2_limit);
  /// Adds to every node the squared norm of (what `projected` saw - what the factors give), from random signs
  /// [row][projection] and projected [projection][node].
  enum class Stored { exactly, rounded };
  void add_error2(Stored stored, std::span<const float> signs, std::span<const float> projected,
                  std::size_t projections, std::vector<double>& error2) const;
};

/// From q^T A [rank][node] to the singular components of the block; nodes as their weights made them.
Factors factorise(const Basis& range, std::size_t rows, std::vector<float> coordinates, std::size_t nodes);

/// Rounds the factors of all bricks into the tiles of `basis`, whose bricks and nodes are set.
void store_factors(std::span<const Factors* const> bricks, CompactBasis& basis);

} // namespace daylit::precompute::detail
