#include "scene/volume/brick_sums.h"

#include <algorithm>

#include "scene/core/tile_kernels.h"
#include "scene/volume/plane_kernels.h"

namespace daylit::detail {

namespace {

/// From the components of a colour to planes, in whole quads.
RoundedWeights plane_weights(const CompactFactors::Brick& brick, std::span<const float> component) {
  std::vector<float> plane(brick.plane_quads() * kQuad, 0.0f);
  for (std::size_t k = 0; k < brick.word_rank; ++k) {
    plane[k] = 256.0f * component[k];
    plane[brick.word_rank + k] = component[k];
  }
  std::copy(component.begin() + brick.word_rank, component.end(), plane.begin() + 2 * brick.word_rank);
  return RoundedWeights(plane);
}

/// One colour of a tile.
void sum_tile(const std::int8_t* tile, std::size_t width, const RoundedWeights& weights, float* sums) {
  std::fill_n(sums, width, 0.0f);
  for (std::size_t first = 0; first < weights.quad.size() && weights.step > 0; first += kMostQuads)
    plane_kernels().sum_numbers(
        tile + first * width * kQuad, width,
        std::span(weights.quad).subspan(first, std::min(kMostQuads, weights.quad.size() - first)), sums);
  for (std::size_t k = 0; k < width; ++k)
    sums[k] *= weights.step;
}

} // namespace

void sum_brick(const CompactFactors::Brick& brick, const std::int8_t* probe_factor, std::span<const float> amplitude,
               std::span<std::array<Rgb, 9>> result) {
  const std::size_t rank = brick.rank();
  const std::array<RoundedWeights, 3> weights{plane_weights(brick, amplitude.first(rank)),
                                              plane_weights(brick, amplitude.subspan(rank, rank)),
                                              plane_weights(brick, amplitude.last(rank))};
  std::array<std::array<float, kTileNumbers>, 3> sums;
  for (std::size_t first = 0; first < brick.numbers(); first += kTileNumbers) {
    const std::size_t width = std::min(kTileNumbers, brick.padded_numbers() - first);
    for (std::size_t c = 0; c < 3; ++c)
      sum_tile(probe_factor + brick.probe_at(0, c, first), width, weights[c], sums[c].data());
    tile_kernels().interleave(sums[0].data(), sums[1].data(), sums[2].data(),
                              std::min(kTileNumbers, brick.numbers() - first), &result[0][0].r + 3 * first);
  }
}

} // namespace daylit::detail
