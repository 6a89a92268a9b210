#pragma once

// What the rows of an exchange matrix miss of one, and its removal.

#include <cstddef>
#include <span>
#include <vector>

#include "radiosity/exchange_matrix.h"
#include "radiosity/patches.h"

namespace daylit::radiosity {

/// Before anything was changed, over the rows that are complete.
struct RowClosure {
  double worst = 0;             ///< largest |row sum of F + opening - 1|
  double mean = 0;              ///< area mean of the same, signed
  std::size_t left = 0;         ///< rows off by more than the limit: no noise, and left as they are
  std::vector<float> deviation; ///< row sum of F + opening - 1 per patch; 0 where the row is not complete
};

struct CloseRowsOptions {
  double limit = 1e-2;         ///< largest deviation that counts as noise of the integration
  bool black_left_out = false; ///< as ExchangeOptions::skip_black: rows of black patches are incomplete and stay
};

/// Scales G to S G S, S diagonal, so that the rows meet one minus `opening` (per patch: its form factor to the
/// outside). Reciprocity stays exact. A deviation of 5e-6 in the mean, harmless in a room with windows, is amplified by
/// 1 / (1 - rho) in a closed one. Symmetric scaling after Sinkhorn (1967); the steps alternate between the root of the
/// ratio, which settles the mean, and the ratio, which settles what differs between neighbours.
RowClosure close_rows(const PatchSet& set, std::span<const float> opening, const CloseRowsOptions& options,
                      ExchangeMatrix& exchange);

} // namespace daylit::radiosity
