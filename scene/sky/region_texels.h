#pragma once

// The pixels of a picture of the sky that a region is made of.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "scene/image/rgb_image.h"
#include "scene/sky/sky_partition.h"

namespace daylit::detail {

struct RegionTexels {
  /// Texels [first, first + count) of the picture, row-major.
  struct Run {
    std::uint32_t first, count;
  };
  std::vector<Run> runs;
  std::vector<float> weight_sr; ///< of each texel, run by run

  void add(std::uint32_t texel, float weight);
  /// Sum over the texels of weight times radiance. Floats, which go to double every few hundred texels.
  std::array<double, 3> sum(std::span<const Rgb> picture) const;
};

/// Of each region: a pixel's weight is its solid angle times the part of the pixel that lies in the region, or the
/// region's hat function there. `needed` as for RegionSums::make().
std::vector<RegionTexels> region_texels(const SkyGeometry& geometry, const SkyPartition& partition,
                                        std::span<const std::uint8_t> needed);

} // namespace daylit::detail
