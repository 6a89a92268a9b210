#pragma once

// The ways from direct light to a volume: one column per constant region, or factors of a fine sky; and the audit.

#include <vector>

#include "precompute/bake.h"
#include "precompute/detail/light_elements.h"
#include "precompute/detail/transport_problem.h"
#include "precompute/probe_fit.h"
#include "radiosity/coefficients.h"

namespace daylit::precompute::detail {

/// What all ways to the volume have in common. Points are the valid probes; `fit` turns light there into probe values.
struct Stage {
  const Problem& problem;
  const LightElements& elements; ///< constant regions: the patches themselves
  const radiosity::WholeFaces& faces;
  const radiosity::ExchangeMatrix& exchange;
  const ProbePoints& points;
  const radiosity::GatherHits& hits; ///< elements seen from the points' positions
  const ProbeFit& fit;
  const std::vector<float>& white; ///< radiosity of the elements under a white sky, mean of the channels
  const BakeOptions& options;
  const Progress& progress;
  StageClock& clock;

  /// Parts of adjoint solves are kept for the nine coefficients only: those of l = 4 have the same names.
  radiosity::SolveOptions solve(radiosity::Bands bands = radiosity::Bands::low) const {
    return {.tolerance = options.tolerance, .store = bands == radiosity::Bands::low ? options.store : nullptr};
  }
};

/// Constant regions: the interior transport from the direct light to the coefficients at the points, by whichever side
/// has fewer columns.
Result<void> bake_regions(const Stage& stage, const radiosity::FirstBounce& light, BasisVolume& volume,
                          BakeReport& report);

/// A sky of nodes: the light on the surfaces node by node (`rows` per element), then the factors from the surfaces to
/// the probes. Returns the element of each source.
Result<std::vector<std::uint32_t>> bake_fine_sky(const Stage& stage, std::vector<radiosity::FirstBounceRow> rows,
                                                 BasisVolume& volume, BakeReport& report);

/// The error of the finished volume: held-out skies taken straight to the probes and to the held-out points. `source`:
/// the element of each of its sources.
Result<AuditReport> audit_bake(const Stage& stage, const Room& room, const BasisVolume& volume,
                               std::span<const std::uint32_t> source);

} // namespace daylit::precompute::detail
