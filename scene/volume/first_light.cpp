#include "scene/volume/first_light.h"

#include <algorithm>
#include <cmath>

#include <Imath/half.h>

#include "scene/core/parallel.h"
#include "scene/volume/row_kernels.h"

namespace daylit {

namespace {

constexpr std::size_t kGrain = 64;       ///< sources; fewer are not worth another thread
constexpr std::size_t kBlockGrain = 512; ///< blocks; the same
constexpr std::size_t kBlock = FirstLight::kBlock;

Error broken(const char* what) {
  return {ErrorCode::file_malformed, what, "compact basis", "bake it again with daylit-precompute"};
}

bool rises_to(const std::vector<std::uint32_t>& offsets, std::size_t end) {
  return !offsets.empty() && offsets.front() == 0 && offsets.back() == end && std::ranges::is_sorted(offsets);
}

/// [block][channel][node of the block], 0 beyond the last node.
std::vector<float> in_blocks(std::span<const Rgb> radiance) {
  const std::size_t whole = radiance.size() / kBlock;
  std::vector<float> blocks(3 * kBlock * ((radiance.size() + kBlock - 1) / kBlock));
  const float* from = &radiance.data()->r;
  const auto copy = [&](std::size_t block, std::size_t count) {
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t k = 0; k < count; ++k)
        blocks[(3 * block + c) * kBlock + k] = from[3 * (block * kBlock + k) + c];
  };
  parallel_for(tbb::blocked_range<std::size_t>(0, whole, kBlockGrain), [&](const auto& part) {
    for (std::size_t block = part.begin(); block < part.end(); ++block)
      copy(block, kBlock);
  });
  copy(whole, radiance.size() % kBlock);
  return blocks;
}

} // namespace

std::size_t FirstLight::bytes() const {
  return 4 * (scale.size() + first_block.size()) + 2 * (block.size() + weight.size());
}

/// E[s, c] = scale[k] sum_b sum_{k < 8} weight[b, k] L[8 block_b + k, c] over the blocks b of a row; k is s, or c S + s
/// behind tinted panes. Units: steradian times radiance, over the unit of the source.
std::vector<Rgb> irradiance_of_sources(const FirstLight& light, std::span<const Rgb> node_radiance) {
  const std::vector<float> radiance = in_blocks(node_radiance);
  const auto of_row = [&](std::size_t row) {
    const std::size_t first = light.first_block[row], count = light.first_block[row + 1] - first;
    return detail::multiply_blocks(light.weight.data() + kBlock * first, std::span(light.block).subspan(first, count),
                                   radiance.data());
  };
  std::vector<Rgb> irradiance(light.sources());
  parallel_for(tbb::blocked_range<std::size_t>(0, irradiance.size(), kGrain), [&](const auto& part) {
    for (std::size_t s = part.begin(); s < part.end(); ++s) {
      irradiance[s] = of_row(s);
      for (std::size_t c = 0; c < 3; ++c) {
        const std::size_t k = (light.colours == 3 ? c * irradiance.size() : 0) + s;
        const int channel = static_cast<int>(c);
        if (k != s && k < light.rows())
          irradiance[s][channel] = of_row(k)[channel];
        irradiance[s][channel] *= light.scale[k];
      }
    }
  });
  return irradiance;
}

void for_each_weight(const FirstLight& light, std::size_t k,
                     const std::function<void(std::size_t node, float weight)>& visit) {
  const std::size_t row = k % light.rows();
  for (std::size_t b = light.first_block[row]; b < light.first_block[row + 1]; ++b)
    for (std::size_t i = 0; i < kBlock; ++i)
      if (const std::uint16_t w = light.weight[kBlock * b + i]; (w & 0x7fffu) != 0)
        visit(kBlock * light.block[b] + i, light.scale[k] * imath_half_to_float(w));
}

/// Nodes of which some row has a weight.
std::vector<std::uint8_t> lit_regions(const FirstLight& light, std::size_t regions) {
  std::vector<std::uint8_t> lit(regions, 0);
  for (std::size_t row = 0; row < light.rows(); ++row)
    for_each_weight(light, row, [&](std::size_t region, float) { lit[region] = 1; });
  return lit;
}

namespace {

/// Increasing, inside the sky, weights finite (exponent bits not all set) and none beyond the last node.
Result<void> check_row(const FirstLight& light, std::size_t row, std::size_t regions) {
  for (std::size_t b = light.first_block[row]; b < light.first_block[row + 1]; ++b) {
    if (b > light.first_block[row] && light.block[b] <= light.block[b - 1])
      return broken("blocks of the first light overlap");
    for (std::size_t k = 0; k < kBlock; ++k) {
      const std::uint16_t magnitude = light.weight[kBlock * b + k] & 0x7fffu;
      if (magnitude >= 0x7c00u)
        return broken("a weight of the first light is not finite");
      if (magnitude != 0 && kBlock * light.block[b] + k >= regions)
        return broken("a weight of the first light is for no region of the sky");
    }
    if (kBlock * light.block[b] >= regions)
      return broken("a block of the first light is outside the sky");
  }
  return {};
}

} // namespace

Result<void> check_first_light(const FirstLight& light, int regions) {
  const std::size_t scales = light.scale.size(), rows = light.first_block.empty() ? 0 : light.rows();
  if ((light.colours != 1 && light.colours != 3) || scales % light.colours != 0 ||
      (rows != scales && rows != light.sources()) || !rises_to(light.first_block, light.block.size()) ||
      light.weight.size() != kBlock * light.block.size())
    return broken("the rows of the first light disagree");
  for (std::size_t row = 0; row < rows; ++row)
    if (const Result<void> good = check_row(light, row, static_cast<std::size_t>(regions)); !good)
      return good;
  if (!std::ranges::all_of(light.scale, [](float x) { return std::isfinite(x); }))
    return broken("a scale of the first light is not finite");
  return {};
}

} // namespace daylit
