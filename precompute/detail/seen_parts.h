#pragma once

// What a cluster of probes distinguishes on the surfaces: the elements of a patch close by, and a patch as a whole from
// afar (aggregation, as in hierarchical matrices: Hackbusch 2015). All that is done for the cluster is done with these
// parts, which are about half as many as the elements.

#include <cstdint>
#include <span>
#include <vector>

#include "precompute/compact_sky.h"
#include "precompute/detail/sun_metric.h"
#include "precompute/surface_light.h"

namespace daylit::precompute::detail {

struct SeenParts {
  /// Elements [first, end) of one patch, or of neighbouring ones that are not seen, the first of which it names.
  struct Part {
    std::uint32_t patch, first, end;
    bool is_element() const { return end - first == 1; }
  };
  std::vector<Part> part;
  std::vector<std::uint32_t> end; ///< element after each part
  /// Of the parts that the sky lights: index in `part`, source cluster, area / that of the source cluster, sources
  /// [first, end).
  struct Lit {
    std::uint32_t part, cluster;
    float cluster_fraction;
    std::uint32_t first, end;
    Rgb reflectance;
    bool is_aggregated() const { return end - first > 1; }
  };
  std::vector<Lit> lit;
  std::vector<float> fraction; ///< of each source in the area of its part

  /// `cluster_fraction`: of each source, as these probes need it; `sight`: of each patch.
  static SeenParts of(const SurfaceLight& light, std::span<const float> cluster_fraction, std::span<const Sight> sight);

  /// Area means over the parts: from values [element][columns].
  std::vector<float> means(const SurfaceLight& light, std::span<const float> of_elements, std::size_t columns) const;
  /// The metric of the irradiance on lit parts, and that irradiance under suns [source][columns]; both in units of
  /// each part's own, sigma.
  SunMetric metric(const SunMetric& of_sources) const;
  std::vector<float> suns(const SunMetric& own, const SunMetric& of_sources, std::span<const float> suns,
                          std::size_t columns) const;
  /// Rows over lit parts to rows over sources.
  std::vector<float> expand(std::span<const float> rows) const;
};

} // namespace daylit::precompute::detail
