#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/vec4.hpp>

#include <glm/geometric.hpp>

#include "runtime/maps/detail/lobe_samples.h"
#include "runtime/maps/detail/prefilter_methods.h"
#include "scene/core/parallel.h"

namespace daylit::detail {
namespace {

/// Samples of a texel: as many as keep the work for a lobe the same, between two bounds. Few texels hold a wide lobe,
/// and a wide lobe needs more samples: each stands for more of the map.
constexpr std::size_t kFewSamples = 32, kManySamples = 1024, kSamplesOfMap = std::size_t(1) << 22;
/// Texels to a standard deviation of the lobe, at least, where a blurred map is computed; then it is enlarged.
constexpr double kTexelsPerDeviation = 2.85;

/// A map with a border of one texel from across the folds, for look-ups without a branch.
struct BorderedMap {
  int side = 0, stride = 0;
  std::vector<glm::vec4> texels;

  explicit BorderedMap(const RadianceMap& map) : side(map.side), stride(map.side + 2) {
    texels.resize(static_cast<std::size_t>(stride) * stride);
    for (int y = -1; y <= side; ++y)
      for (int x = -1; x <= side; ++x)
        texels[static_cast<std::size_t>(y + 1) * stride + (x + 1)] = glm::vec4(map.at_folded(x, y), 0.0f);
  }

  /// Bilinear; (u, v) in [0, 1]^2.
  glm::vec4 at(float u, float v) const {
    const float x = std::min(std::max(u, 0.0f), 1.0f) * static_cast<float>(side) + 0.5f;
    const float y = std::min(std::max(v, 0.0f), 1.0f) * static_cast<float>(side) + 0.5f;
    const int i = std::min(static_cast<int>(x), side), j = std::min(static_cast<int>(y), side);
    const float s = x - static_cast<float>(i), t = y - static_cast<float>(j);
    const glm::vec4* p = &texels[static_cast<std::size_t>(j) * stride + i];
    return (1.0f - t) * ((1.0f - s) * p[0] + s * p[1]) + t * ((1.0f - s) * p[stride] + s * p[stride + 1]);
  }
};

/// Levels of a chain: the map, and its halves down to 4 x 4.
std::vector<BorderedMap> chain_of(const RadianceMap& map) {
  std::vector<BorderedMap> chain{BorderedMap(map)};
  for (RadianceMap level = map; level.side > 4;) {
    level = halved(level);
    chain.emplace_back(level);
  }
  return chain;
}

/// Mean over the samples, each between the two levels of its solid angle.
Rgb sampled_mean(const std::vector<BorderedMap>& chain, const LobeSamples& samples, const glm::vec3& axis) {
  float u[kManySamples], v[kManySamples];
  sample_points(samples, axis, u, v);
  glm::vec4 sum(0.0f);
  for (std::size_t k = 0; k < samples.size(); ++k) {
    const std::size_t fine = std::min(static_cast<std::size_t>(samples.level[k]), chain.size() - 2);
    const float part = samples.level[k] - static_cast<float>(fine);
    sum += (1.0f - part) * chain[fine].at(u[k], v[k]) + part * chain[fine + 1].at(u[k], v[k]);
  }
  return Rgb(sum) / static_cast<float>(samples.size());
}

int working_side(const Lobe& lobe) {
  int side = 8;
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

/// Krivanek & Colbert 2008, "Real-time shading with filtered importance sampling", on a map of equal texels. Where the
/// lobe is wide the blurred map is computed with fewer texels and enlarged.
void mip_lobes(const PrefilterJob& job) {
  const std::vector<BorderedMap> chain = chain_of(job.source);
  for (std::size_t k = 0; k < job.lobes.size(); ++k) {
    const Lobe& lobe = job.lobes[k];
    RadianceMap small(working_side(lobe));
    const std::size_t count = std::clamp(kSamplesOfMap / small.radiance.size(), kFewSamples, kManySamples);
    const LobeSamples samples(lobe.exponent, count, job.source.solid_angle_sr(), static_cast<int>(chain.size()));
    fill(
        job, small,
        [&](int x, int y) {
          return sampled_mean(chain, samples, small.direction(static_cast<std::size_t>(y) * small.side + x));
        },
        [](auto&&) {});
    const BorderedMap from(small);
    const float scale = 1.0f / static_cast<float>(lobe.side);
    fill(
        job, job.maps[k],
        [&](int x, int y) {
          return Rgb(from.at((static_cast<float>(x) + 0.5f) * scale, (static_cast<float>(y) + 0.5f) * scale));
        },
        [&](std::span<const std::uint32_t> texels) {
          if (job.options.tile_done)
            job.options.tile_done({k, texels}, job.maps[k]);
        });
  }
}

} // namespace daylit::detail
