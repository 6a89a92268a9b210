#pragma once

// How much memory a bake takes at once, from the counts of its first stage, and how much it may take.

#include "precompute/bake.h"

namespace daylit::precompute {

/// Most bytes that a bake holds at once, `counts` as count_bake() finds them; without rays of probes, which are kept as
/// far as there is room for them.
double needed_memory(const BakeReport& counts, const SkyPartition& partition, const BakeOptions& options);

/// Error limit_exceeded: more is needed than may be taken (0: no limit).
Result<void> check_memory(double needed_bytes, double allowed_bytes);

/// Bytes that a bake may take: what is wanted (0: 60 % of the machine or of its control group), or what `ulimit -v`
/// leaves where that is less. Error limit_exceeded: that is nothing.
Result<double> allowed_memory(double wanted_bytes);

} // namespace daylit::precompute
