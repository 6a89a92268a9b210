#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "radiosity/detail/pair_kernel.h"

namespace daylit::radiosity {

struct LowRank {
  std::uint32_t rank = 0;
  std::vector<float> values; ///< U (rows x rank), then V (columns x rank), row-major; the rectangle is U V^T
};

/// Adaptive cross approximation (Bebendorf 2000) of the unoccluded kernel between patches [row, row + rows) and
/// [column, column + columns): the remainder is estimated below `tolerance` of the rectangle's Frobenius norm.
/// Nothing when a dense rectangle is smaller, or when a pair is too close for the nine-point rule.
std::optional<LowRank> cross_approximation(const PairArrays& arrays, std::uint32_t row, std::uint32_t rows,
                                           std::uint32_t column, std::uint32_t columns, double tolerance);

} // namespace daylit::radiosity
