#pragma once

// The transport from thousands of sky directions, kept small: the light on the surfaces as a sparse matrix, and from
// the surfaces, per brick of neighbouring probes, the best product of two factors, all bricks cut off at one common
// threshold so that the error asked for costs the fewest numbers. Best is meant for suns: the error is that of the
// field under a small sun, in the mean over the directions of the sky.

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "precompute/surface_light.h"
#include "scene/core/program.h"
#include "scene/core/result.h"
#include "scene/sky/sky_partition.h"
#include "scene/volume/compact_basis.h"
#include "scene/volume/volume.h"

namespace daylit::precompute {

struct CompactOptions {
  /// Root mean square over the sky's directions of |error| / |light| under a small sun there; directions that light
  /// less than 1/20 of the brightest are measured against that. Below the horizon, where no sun is, an
  /// error counts a quarter.
  double error = 0.03;
  std::size_t cluster_probes = 180; ///< at most; fewer cost more source factors, more cost more rank
  /// Of each point: no brick holds points of two parts, because the error of a brick is shared by its points and light
  /// must not come through a wall. Empty: all in one.
  std::span<const std::uint32_t> part = {};
};

struct CompactReport {
  std::size_t nodes = 0, sources = 0, clusters = 0, probe_clusters = 0, bytes = 0; ///< nodes: that light any source
  std::size_t band4_probe_clusters = 0, band4_components = 0, band4_bytes = 0;     ///< what was kept of l = 4
  double mean_rank = 0, strong_fraction = 0;    ///< of the nine: components per brick; share of them kept as words
  double rms_error = 0, largest_error = 0; ///< relative, measured on the stored factors (random projections)
  double seconds = 0;
};

/// What some points see.
struct GatherRows {
  /// Marks the patches whose leaves one of the points tells apart.
  std::function<void(std::span<const std::uint32_t> points, std::span<std::uint8_t> patches)> distinguished;
  /// Nine rows [lm][piece] for each point: coefficient = sum over pieces of row * radiosity. Pieces are runs of leaves,
  /// each given by its end.
  std::function<void(std::span<const std::uint32_t> points, std::span<const std::uint32_t> piece_end, float* rows)>
      rows;
  /// The same for the coefficients of l = 4. Empty: these are left out.
  std::function<void(std::span<const std::uint32_t> points, std::span<const std::uint32_t> piece_end, float* rows)>
      band4_rows = {};
};

/// Point p is probe probe_of_point[p]. `partition` is one of nodes. Errors: interrupted.
Result<CompactBasis> compact_sky(const SurfaceLight& light, const GatherRows& gather, const ProbeSet& probes,
                                 std::span<const std::size_t> probe_of_point, const SkyPartition& partition,
                                 const CompactOptions& options, const Progress& progress,
                                 CompactReport* report = nullptr);

} // namespace daylit::precompute
