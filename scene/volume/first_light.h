#pragma once

// The light that the sky throws on the surfaces of a room: a sparse matrix from sky regions to pieces of surface. What
// a piece sees of the sky through a window is a patch of neighbouring directions, so its weights lie in blocks of eight
// regions, which begin at multiples of eight: no vector of radiances crosses a cache line.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "scene/core/half_float.h"
#include "scene/core/result.h"
#include "scene/image/rgb_image.h"

namespace daylit {

/// Rows are pieces of surface, or three per piece (all red, all green, all blue) where panes are tinted.
struct FirstLight {
  static constexpr std::size_t kBlock = 8;

  std::vector<float> scale;               ///< of each row
  std::vector<std::uint32_t> first_block; ///< of each row, and one more: the end
  std::vector<std::uint16_t> block;       ///< regions from kBlock * block on (no sky has 2^19); increasing within a row
  std::vector<std::uint16_t> weight;      ///< half floats, kBlock for each block; 0 for regions beyond the last

  std::size_t rows() const { return scale.size(); }
  std::size_t bytes() const;
};

/// scale * sum weight * radiance for each of `pieces` pieces. Independent of the thread count.
std::vector<Rgb> received(const FirstLight& light, std::size_t pieces, std::span<const Rgb> region_radiance);

/// Calls visit(region, weight) for the weights of a row that are not 0, regions increasing.
template <class Visit>
void for_each_weight(const FirstLight& light, std::size_t row, const Visit& visit) {
  for (std::size_t b = light.first_block[row]; b < light.first_block[row + 1]; ++b)
    for (std::size_t k = 0; k < FirstLight::kBlock; ++k)
      if (const std::uint16_t w = light.weight[b * FirstLight::kBlock + k]; (w & 0x7fffu) != 0)
        visit(light.block[b] * FirstLight::kBlock + k, light.scale[row] * detail::from_half(w));
}

/// The regions that light anything: [region] is 1.
std::vector<std::uint8_t> lit_regions(const FirstLight& light, std::size_t regions);

/// Blocks lie inside the sky and rise within a row, offsets rise, numbers are finite, none is beyond the last region.
Result<void> check_first_light(const FirstLight& light, std::size_t pieces, int regions);

} // namespace daylit
