#pragma once

// Some columns of the radiosity system in its symmetric form, solved together.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "radiosity/detail/cholesky.h"
#include "radiosity/exchange_matrix.h"
#include "radiosity/solve.h"

namespace daylit::radiosity {

struct PanelResult {
  std::int32_t iterations = -1;          ///< -1: the limit was met first
  std::vector<float> residual, solution; ///< relative, [column]; [position][column]

  std::vector<std::byte> bytes() const;
  /// False when `raw` is not the bytes of a panel of so many values and columns.
  bool take(const std::optional<std::vector<std::byte>>& raw, std::size_t values, std::size_t width);
};

/// Solves z - S G S z = r for `width` columns, [tree position][column], by the factor when there is one, else by
/// conjugate gradients. `scale`: the diagonal S per position.
PanelResult solve_panel(const ExchangeMatrix& exchange, const std::vector<float>& scale, std::vector<float> right_side,
                        std::size_t width, const SolveOptions& options, const CholeskyFactor* factor);

} // namespace daylit::radiosity
