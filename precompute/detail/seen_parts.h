#pragma once

// What a brick of probes tells apart on the surfaces: the leaves of a patch close by, and a patch as a whole from
// afar. All that is done for the brick is done with these pieces, which are about half as many as the leaves.

#include <cstdint>
#include <span>
#include <vector>

#include "precompute/detail/sun_metric.h"
#include "precompute/surface_light.h"

namespace daylit::precompute::detail {

struct SeenParts {
  /// Leaves [first, end) of one patch.
  struct Piece {
    std::uint32_t patch, first, end;
  };
  std::vector<Piece> piece;
  std::vector<std::uint32_t> end; ///< leaf after each piece
  /// Of the pieces that the sky lights: number in `piece`, cluster, area / that of the cluster, sources [first, end).
  struct Lit {
    std::uint32_t piece, cluster;
    float cluster_share;
    std::uint32_t first, end;
    Rgb reflectance;
  };
  std::vector<Lit> lit;
  std::vector<float> share; ///< of each source in its piece's area

  /// `distinguished`: of each patch.
  static SeenParts of(const SurfaceLight& light, std::span<const std::uint8_t> distinguished);

  /// Means over the pieces: from values [leaf][columns].
  std::vector<float> means(const SurfaceLight& light, std::span<const float> of_leaves, std::size_t columns) const;
  /// The metric of the irradiance on lit pieces, and that irradiance under suns [source][columns]; both in units of
  /// each piece's own, which is `unit`.
  SunMetric metric(const SunMetric& of_sources) const;
  std::vector<float> suns(const SunMetric& own, const SunMetric& of_sources, std::span<const float> suns,
                          std::size_t columns) const;
  /// Rows over lit pieces to rows over sources.
  std::vector<float> expand(std::span<const float> rows) const;
};

} // namespace daylit::precompute::detail
