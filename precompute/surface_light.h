#pragma once

// The light between surfaces as the fine sky needs it: which elements of the surfaces the sky lights from where, and
// what a lit element gives in two parts. What it sends out itself is exact. What comes back after further bounces is
// smooth, so it is solved between patches, once for each cluster of neighbouring ones, from the mean light on the
// cluster, in which each patch counts as much as what it sends on matters to the probes that are looked after.

#include <cstdint>
#include <span>
#include <vector>

#include "precompute/detail/light_elements.h"
#include "radiosity/energy.h"
#include "radiosity/first_bounce.h"
#include "radiosity/solve.h"
#include "scene/core/program.h"

namespace daylit::precompute {

struct SurfaceLight {
  std::size_t patches = 0, elements = 0, clusters = 0;
  std::vector<std::uint32_t> parent;            ///< patch of each element
  std::vector<float> element_fraction;          ///< of each element in its patch's area
  detail::LinearLight further;                  ///< of LightElements; empty: each element has what its patch has
  std::vector<std::uint32_t> source;            ///< elements that the sky lights and that reflect, increasing
  std::vector<radiosity::FirstBounceRow> light; ///< of each source
  std::vector<std::uint32_t> cluster;           ///< of each source
  std::vector<float> cluster_fraction;          ///< of each source: what its light counts in its cluster's mean
  std::vector<float> fraction_for_probes;       ///< the same for each group of probes, [group][source]
  std::vector<Rgb> reflectance;                 ///< of each source
  /// [patch][channel * clusters + cluster]: radiosity after one or more further bounces for irradiance 1 on a
  /// cluster.
  std::vector<float> bounced;

  std::span<const float> fraction_for(std::size_t group) const {
    return std::span(fraction_for_probes).subspan(group * source.size(), source.size());
  }
};

struct SurfaceLightReport {
  radiosity::SolveReport solve;
  radiosity::EnergyBalance energy; ///< of the whole sky
};

/// One source for all of a cluster that lie on patches with `seen` 0: exact where no probe sees those, because only the
/// cluster's mean comes from them.
SurfaceLight join_unseen(SurfaceLight light, std::span<const std::uint8_t> seen);

/// What the probes are to the patches.
struct ProbeSight {
  /// Of each patch: 0 where no probe sees any of it. Its light counts only as a part of its cluster's, so that all such
  /// sources of a cluster become one.
  std::vector<std::uint8_t> seen;
  /// [group of probes][patch], at least 0: what its light brings to these probes by further bounces, for equal
  /// irradiance and area, in any unit.
  std::vector<float> further;
};

/// `rows`: of each element. At most `clusters` clusters. Errors as solve_radiosity().
Result<SurfaceLight> surface_light(const radiosity::PatchSet& set, const detail::LightElements& elements,
                                   const radiosity::ExchangeMatrix& exchange,
                                   std::vector<radiosity::FirstBounceRow> rows, const ProbeSight& probes,
                                   std::size_t clusters, const radiosity::SolveOptions& options,
                                   const Progress& progress, SurfaceLightReport& report);

} // namespace daylit::precompute
