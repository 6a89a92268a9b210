#pragma once

// The transport from thousands of sky directions, kept small: per brick of neighbouring probes the best product of two
// factors, all bricks cut off at one common threshold so that the error asked for costs the fewest numbers.

#include <cstdint>
#include <span>
#include <vector>

#include "scene/compact_basis.h"
#include "scene/program.h"
#include "scene/result.h"
#include "scene/sky_partition.h"
#include "scene/volume.h"

namespace daylit::precompute {

struct CompactOptions {
  /// Root mean square over the sky's directions of |error| / |light| under a small sun there; directions that light
  /// less than 1/20 of the brightest are measured against that.
  double error = 0.03;
  std::size_t brick_probes = 180; ///< at most; fewer cost more node factors, more cost more rank
};

struct CompactReport {
  std::size_t nodes = 0, bricks = 0, bytes = 0;
  double mean_rank = 0, half_share = 0;    ///< components per brick; share of them kept as half floats
  double rms_error = 0, largest_error = 0; ///< relative, measured on the stored factors (random projections)
  double seconds = 0;
};

/// `coefficients`: [point][lm][channel * regions + region] of the regions `stored`, of constant regions of radiance 1;
/// point p is probe probe_of_point[p]. `partition` is one of nodes. Sharpens the constant regions to nodes: a region's
/// mean and linear interpolation blur the response by 1/8 of its second difference, which is taken out.
/// Errors: interrupted.
Result<CompactBasis> compact_sky(std::span<const float> coefficients, const ProbeSet& probes,
                                 std::span<const std::size_t> probe_of_point, const SkyPartition& partition,
                                 std::span<const std::int32_t> stored, const CompactOptions& options,
                                 const Progress& progress, CompactReport* report = nullptr);

} // namespace daylit::precompute
