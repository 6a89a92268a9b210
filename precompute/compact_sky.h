#pragma once

// The transport from thousands of sky directions, kept small (scene/volume/compact_basis.h): the light on the surfaces
// as a sparse matrix, and from the surfaces, per cluster of neighbouring probes, the best product of two factors
// (truncated singular value decomposition), all clusters cut off at one common threshold so that the error asked for
// costs the fewest numbers. Best is meant for suns: the error is that of the field under a small sun, in the mean over
// the directions of the sky.

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
};

/// At most; fewer cost more source factors, more cost more rank.
constexpr std::size_t kProbesInCluster = 180;
/// The same of given points: far apart, they have little in common that a few components could hold.
constexpr std::size_t kGivenPointsInCluster = 24;

struct CompactReport {
  std::size_t nodes = 0, sources = 0; ///< nodes: that light any source
  std::size_t clusters = 0;           ///< of sources, for which further bounces are solved
  std::size_t probe_clusters = 0, bytes = 0;
  std::size_t band4_probe_clusters = 0, band4_components = 0, band4_bytes = 0; ///< what was kept of l = 4
  double mean_rank = 0;                    ///< of the nine: components per probe cluster
  double strong_fraction = 0;              ///< of them, that have 16 bits a number
  double rms_error = 0, largest_error = 0; ///< relative, measured on the stored factors (random projections)
  double seconds = 0;
};

/// Of a patch: no ray of some points meets it, some do, or its elements are distinguished by one of the points.
enum class Sight : std::uint8_t { none, of_patch, of_elements };

/// What some points see. A part is a run of elements that are seen as one, given by its end.
struct GatherRows {
  using Points = std::span<const std::uint32_t>;
  /// Of each patch.
  std::function<void(Points points, std::span<Sight> patches)> sight;
  /// Nine rows [lm][part] for each point: coefficient = sum over parts of row * radiosity.
  std::function<void(Points points, std::span<const std::uint32_t> part_end, float* rows)> rows;
  /// The same for the coefficients of l = 4. Empty: these are left out.
  std::function<void(Points points, std::span<const std::uint32_t> part_end, float* rows)> band4_rows = {};
};

/// Points of each cluster of probes. Point p is probe probe_of_point[p].
using ProbeClusters = std::vector<std::vector<std::uint32_t>>;
/// `part`: of each point. No cluster holds points of two parts of the air, because the error of a cluster is shared by
/// its points and light must not come through a wall. Empty: all in one. `most`: points in a cluster.
ProbeClusters probe_clusters(const ProbeSet& probes, std::span<const std::size_t> probe_of_point,
                             std::span<const std::uint32_t> part, std::size_t most);

/// `light`: with fractions for each of the clusters; `partition`: of nodes. Errors: interrupted.
Result<CompactBasis> compact_sky(const SurfaceLight& light, const GatherRows& gather, const ProbeClusters& clusters,
                                 std::span<const std::size_t> probe_of_point, const SkyPartition& partition,
                                 const CompactOptions& options, const Progress& progress,
                                 CompactReport* report = nullptr);

} // namespace daylit::precompute
