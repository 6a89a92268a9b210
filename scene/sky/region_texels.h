#pragma once

// The pixels of a picture of the sky that a region is made of.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "scene/image/rgb_image.h"
#include "scene/sky/sky_partition.h"

namespace daylit::detail {

/// A run of neighbouring texels [first, first + count) of the picture, row-major.
struct TexelRun {
  std::uint32_t first, count;
};

/// The pixels of one region.
struct RegionTexels {
  std::vector<TexelRun> runs;
  std::vector<float> weight_sr; ///< of each texel, run by run

  void add(std::uint32_t texel, float weight);
};

/// Of each region: a pixel's weight is its solid angle times the part of the pixel that lies in the region, or the
/// region's hat function there. `needed` as for RegionSums::make().
std::vector<RegionTexels> region_texels(const SkyGeometry& geometry, const SkyPartition& partition,
                                        std::span<const std::uint8_t> needed);

/// The same for all regions as the rows of one sparse matrix.
struct TexelMatrix {
  std::vector<std::size_t> first_run, first_weight; ///< of each region, and the end
  std::vector<TexelRun> runs;
  std::vector<float> weight_sr;

  explicit TexelMatrix(std::span<const RegionTexels> regions);
  /// sums[region - first][c] = sum over the region's texels of weight times radiance, for regions [first, end). Floats,
  /// which go to double every few hundred texels.
  void sum(std::size_t first, std::size_t end, std::span<const Rgb> picture,
           std::span<std::array<double, 3>> sums) const;
  std::size_t bytes() const { return runs.size() * sizeof(TexelRun) + weight_sr.size() * sizeof(float); }
};

} // namespace daylit::detail
