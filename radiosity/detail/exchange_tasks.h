#pragma once

// The work of filling an exchange matrix, in parts that can be kept and taken up again.

#include <vector>

#include "radiosity/detail/exchange_tile.h"

namespace daylit::radiosity {

/// Fills all blocks of the plan: from the store of the problem's options where they are there, else computed and kept.
/// Error: interrupted.
Result<void> fill_blocks(ExchangeProblem& problem, const ExchangePlan& plan, std::vector<ExchangeBlock>& blocks,
                         const Progress& progress);

} // namespace daylit::radiosity
