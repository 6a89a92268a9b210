#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/vec4.hpp>

#include <glm/geometric.hpp>

#include "runtime/maps/detail/lobe_samples.h"
#include "runtime/maps/detail/map_tiles.h"
#include "runtime/maps/detail/prefilter_methods.h"
#include "scene/core/parallel.h"

namespace daylit::detail {
namespace {

constexpr std::size_t kSamples = 32;
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
  float u[kSamples], v[kSamples];
  sample_points(samples, axis, u, v);
  glm::vec4 sum(0.0f);
  for (std::size_t k = 0; k < kSamples; ++k) {
    const std::size_t fine = std::min(static_cast<std::size_t>(samples.level[k]), chain.size() - 2);
    const float part = samples.level[k] - static_cast<float>(fine);
    sum += (1.0f - part) * chain[fine].at(u[k], v[k]) + part * chain[fine + 1].at(u[k], v[k]);
  }
  return Rgb(sum) / static_cast<float>(kSamples);
}

int working_side(const Lobe& lobe) {
  int side = 8;
  while (side < lobe.side && side < kTexelsPerDeviation * std::sqrt(4.0 * std::numbers::pi * lobe.exponent))
    side *= 2;
  return std::min(side, lobe.side);
}

/// body(tile) for the tiles of a map, unless stopped.
template <class Body>
void for_each_tile(const PrefilterJob& job, int side, const Body& body) {
  const int width = tile_side(side), across = side / width;
  parallel_for(0, across * across, [&](int t) {
    if (!job.options.stop.stop_requested())
      body(MapTile{0, t % across * width, t / across * width, width});
  });
}

template <class Value>
void fill(RadianceMap& map, const MapTile& tile, const Value& value) {
  for (int y = tile.row; y < tile.row + tile.width; ++y)
    for (int x = tile.column; x < tile.column + tile.width; ++x)
      map.radiance[static_cast<std::size_t>(y) * map.side + x] = value(x, y);
}

} // namespace

/// Krivanek & Colbert 2008, "Real-time shading with filtered importance sampling", on a map of equal texels. Where the
/// lobe is wide the blurred map is computed with fewer texels and enlarged.
void mip_lobes(const PrefilterJob& job) {
  const std::vector<BorderedMap> chain = chain_of(job.source);
  for (std::size_t k = 0; k < job.lobes.size(); ++k) {
    const Lobe& lobe = job.lobes[k];
    const LobeSamples samples(lobe.exponent, kSamples, job.source.solid_angle_sr(), static_cast<int>(chain.size()));
    RadianceMap small(working_side(lobe));
    for_each_tile(job, small.side, [&](const MapTile& tile) {
      fill(small, tile, [&](int x, int y) {
        return sampled_mean(chain, samples, small.direction(static_cast<std::size_t>(y) * small.side + x));
      });
    });
    const BorderedMap from(small);
    const float scale = 1.0f / static_cast<float>(lobe.side);
    for_each_tile(job, lobe.side, [&](MapTile tile) {
      fill(job.maps[k], tile, [&](int x, int y) {
        return Rgb(from.at((static_cast<float>(x) + 0.5f) * scale, (static_cast<float>(y) + 0.5f) * scale));
      });
      tile.lobe = k;
      if (job.options.tile_done)
        job.options.tile_done(tile, job.maps[k]);
    });
  }
}

} // namespace daylit::detail
