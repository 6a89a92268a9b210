#pragma once

#include <vector>

#include "radiosity/exchange_matrix.h"

namespace daylit::radiosity {

/// The whole matrix, [patch][patch], row-major.
inline std::vector<float> dense(const ExchangeMatrix& exchange) {
  const std::size_t n = exchange.size();
  const std::vector<float> ordered = exchange.dense_in_tree_order();
  std::vector<float> result(n * n);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j)
      result[exchange.order()[i] * n + exchange.order()[j]] = ordered[i * n + j];
  return result;
}

} // namespace daylit::radiosity
