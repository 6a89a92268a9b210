#pragma once

#include <optional>
#include <vector>

#include "radiosity/exchange_matrix.h"

namespace daylit::radiosity {

/// The factor of I - S G S with S = diag(scale), in tree order, single precision: pays when it serves many columns.
class CholeskyFactor {
public:
  /// Nothing when the matrix is not positive definite within rounding (a closed room that absorbs nothing).
  static std::optional<CholeskyFactor> of(const ExchangeMatrix& exchange, const std::vector<float>& scale);

  /// Solves in place for `columns` columns, [position][column].
  void solve(float* right_sides, std::size_t columns) const;

  /// Worth it against `iterations` products with the hierarchical matrix per column? By operations: both run at about
  /// the same speed.
  static bool cheaper(const ExchangeMatrix& exchange, std::size_t columns, int iterations);

private:
  std::size_t n_ = 0;
  std::vector<float> factor_;
};

} // namespace daylit::radiosity
