#include <algorithm>
#include <cmath>
#include <numbers>

#include "runtime/maps/detail/lobe_samples.h"
#include "runtime/maps/detail/prefilter_methods.h"
#include "scene/core/parallel.h"

namespace daylit::detail {
namespace {

/// Samples of a texel: as many as keep the work for a lobe the same, between two bounds. Few texels hold a wide lobe,
/// and a wide lobe needs more samples: each stands for more of the map.
constexpr std::size_t kFewSamples = 64, kManySamples = LobeSamples::kMost, kSamplesOfMap = std::size_t(1) << 21;
/// Texels to a standard deviation of the lobe, at least, where a blurred map is computed; then it is enlarged.
constexpr double kTexelsPerDeviation = 2.0;
/// Side of the coarsest of these: the folds of a coarser one show.
constexpr int kFewestTexels = 32;

/// Levels of a chain: the map, and its halves down to 4 x 4.
std::vector<MipLevel> chain_of(const RadianceMap& map) {
  std::vector<MipLevel> chain{MipLevel(map)};
  for (RadianceMap level = map; level.side > 4;) {
    level = halved(level);
    chain.emplace_back(level);
  }
  return chain;
}

int working_side(const Lobe& lobe) {
  int side = kFewestTexels;
  while (side < lobe.side && side < kTexelsPerDeviation * std::sqrt(4.0 * std::numbers::pi * lobe.exponent))
    side *= 2;
  return std::min(side, lobe.side);
}

/// value(column, row) for every texel, a few rows at a time, unless stopped; done(texels) after each.
template <class Value, class Done>
void fill(const PrefilterJob& job, RadianceMap& map, const Value& value, const Done& done) {
  parallel_for(tbb::blocked_range<int>(0, map.side, 4), [&](const tbb::blocked_range<int>& rows) {
    if (job.options.stop.stop_requested())
      return;
    std::vector<std::uint32_t> texels;
    for (int y = rows.begin(); y != rows.end(); ++y)
      for (int x = 0; x < map.side; ++x) {
        texels.push_back(static_cast<std::uint32_t>(y * map.side + x));
        map.radiance[texels.back()] = value(x, y);
      }
    done(texels);
  });
}

} // namespace

/// Where the lobe is wide the blurred map is computed with fewer texels and enlarged.
void mip_lobes(const PrefilterJob& job) {
  const std::vector<MipLevel> chain = chain_of(job.source);
  for (std::size_t k = 0; k < job.lobes.size(); ++k) {
    const Lobe& lobe = job.lobes[k];
    RadianceMap small(working_side(lobe));
    const std::size_t count = std::clamp(kSamplesOfMap / small.radiance.size(), kFewSamples, kManySamples);
    const LobeSamples samples(lobe.exponent, count, job.source.solid_angle_sr(), static_cast<int>(chain.size()));
    fill(
        job, small,
        [&](int x, int y) {
          return mean_of_samples(samples, chain,
                                 glm::vec3(small.direction(static_cast<std::size_t>(y) * small.side + x)));
        },
        [](auto&&) {});
    const MipLevel from(small);
    const float scale = 1.0f / static_cast<float>(lobe.side);
    fill(
        job, job.maps[k],
        [&](int x, int y) {
          return from.cubic((static_cast<float>(x) + 0.5f) * scale, (static_cast<float>(y) + 0.5f) * scale);
        },
        [&](std::span<const std::uint32_t> texels) {
          if (job.options.tile_done)
            job.options.tile_done({k, texels}, job.maps[k]);
        });
  }
}

} // namespace daylit::detail
