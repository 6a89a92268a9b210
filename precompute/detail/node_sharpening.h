#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "scene/sky_partition.h"

namespace daylit::precompute::detail {

/// Sparse map from constant regions to nodes: response of node j = sum weight * response of region `column`.
struct NodeSharpening {
  struct Term {
    std::uint32_t node;   ///< index into region
    std::uint32_t column; ///< index into the stored regions
    float weight;
  };
  std::vector<std::int32_t> region; ///< of each node that receives anything, increasing
  std::vector<Term> terms;

  /// [rows][nodes] from [rows][columns].
  std::vector<float> apply(std::span<const float> values, std::size_t rows, std::size_t columns) const;
};

/// Response per solid angle D' = D - (second difference along azimuth + along altitude) / 8, unstored regions black.
/// Along each axis the mean over a region widens a point by 1/24 of the second difference, linear interpolation by 1/12
/// in the mean over all positions.
NodeSharpening sharpen_nodes(const SkyPartition& partition, std::span<const std::int32_t> stored);

} // namespace daylit::precompute::detail
