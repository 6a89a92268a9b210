#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include <glm/common.hpp>

#include "runtime/maps/detail/prefilter_methods.h"
#include "runtime/maps/detail/tile_pairs.h"
#include "scene/core/parallel.h"

namespace daylit::detail {
namespace {

/// Of the tolerance, that skipped tiles may cost, and tiles summed at points.
constexpr double kShare = 0.4;
/// Work for a pair of tiles over that for a pair of texels.
constexpr double kBoundCost = 30.0;
/// Below this part of the mean of the map a texel's error is relative to that.
constexpr double kFloor = 1e-6;

struct Source {
  const RadianceMap& map;
  TexelOrder order;

  explicit Source(const RadianceMap& m) : map(m), order(m) {}
};

/// What a lobe needs of the source.
struct LobeSource {
  float exponent = 1.0f;
  Tiles tiles;
  TiledCharges texels;
  std::vector<glm::dvec3> sum; ///< of the radiance of each tile
  TiledCharges coarse;         ///< groups about half as wide as the lobe's standard deviation
  double smallest[4] = {};     ///< red, green, blue, weight: what a sum is taken to be at least
  std::optional<SmoothLobe> smooth;
  std::optional<Chebyshev> chebyshev;
  TiledCharges points;

  LobeSource(const Source& source, const Lobe& lobe, std::size_t per_tile, double tolerance);
};

/// Groups of texels whose side is below half a standard deviation, 16 of them in a tile at least.
std::size_t group_size(std::size_t map_texels, double exponent, std::size_t per_tile) {
  std::size_t group = 1;
  while (32 * group <= per_tile && std::sqrt(4.0 * std::numbers::pi * exponent * 2.0 * static_cast<double>(group) /
                                             static_cast<double>(map_texels)) < 0.5)
    group *= 2;
  return group;
}

double wanted_error(double tolerance) { return kShare * tolerance / 100.0; }

LobeSource::LobeSource(const Source& source, const Lobe& lobe, std::size_t per_tile, double tolerance)
    : exponent(static_cast<float>(lobe.exponent)), tiles(source.order, per_tile),
      texels(texel_charges(source.map, tiles)), sum(tiles.frames.size(), glm::dvec3(0.0)),
      coarse(group_charges(source.map, tiles, group_size(source.map.radiance.size(), lobe.exponent, per_tile))),
      smooth(smooth_lobe(lobe.exponent, tiles.largest_half(), per_tile, wanted_error(tolerance))) {
  glm::dvec3 whole(0.0);
  for (std::size_t t = 0; t < sum.size(); ++t) {
    for (const std::uint32_t texel : tiles.texels_of(t))
      sum[t] += glm::dvec3(source.map.radiance[texel]);
    whole += sum[t];
  }
  // integral of the lobe over the sphere: 2 pi / (exponent + 1) of 4 pi
  for (int c = 0; c < 3; ++c)
    smallest[c] = std::max(kFloor * whole[c] / (2.0 * lobe.exponent + 2.0), std::numeric_limits<double>::min());
  if (smooth) {
    chebyshev.emplace(smooth->order);
    points = point_charges(source.map, tiles, *chebyshev);
  }
}

/// Texels of a tile with the least work for an output texel: caps of the lobe's reach, at points where that is
/// possible.
std::size_t tile_texels(const Source& source, const Lobe& lobe, double tolerance) {
  const std::size_t all = source.order.texel.size();
  std::size_t best = 16;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t size = 16; size <= 1024 && 16 * size <= all; size *= 4) {
    const double side = std::sqrt(4.0 * std::numbers::pi * static_cast<double>(size) / static_cast<double>(all));
    // e^-25 of the lobe: bright lights
    const double reach = std::min(1.5, std::sqrt(50.0 / lobe.exponent)) + 1.5 * side;
    const double cap = 0.5 - 0.5 * std::cos(std::min(reach, std::numbers::pi / 2.0));
    const auto smooth = smooth_lobe(lobe.exponent, 0.85 * side, size, wanted_error(tolerance));
    const double part = smooth ? std::pow(smooth->order * smooth->order / static_cast<double>(size), 2) : 1.0;
    const double edge = smooth && lobe.exponent < 30.0 ? 1.5 * side : 0.0;
    const double bounds = kBoundCost / (static_cast<double>(size) * static_cast<double>(size));
    if (const double work = cap * part + edge + bounds; work < least) {
      least = work;
      best = size;
    }
  }
  return best;
}

/// Adds the tiles that are summed in the given way.
void add_tiles(const TiledCharges& from, std::span<const Summing> summing, Summing way,
               std::span<const glm::vec3> points, float exponent, std::span<LobeSum> sums) {
  std::vector<ChargeRange> ranges;
  for (std::size_t t = 0; t < summing.size(); ++t)
    if (summing[t] == way) {
      if (!ranges.empty() && ranges.back().first + ranges.back().count == t * from.per_tile)
        ranges.back().count += from.per_tile;
      else
        ranges.push_back({t * from.per_tile, from.per_tile});
    }
  add_lobe(from.charges, ranges, points, exponent, sums);
}

/// One tile of one blurred map.
class ExactTile {
public:
  ExactTile(const LobeSource& lobe, const Tiles& tiles, std::size_t tile, double tolerance)
      : lobe_(lobe), tiles_(tiles), tile_(tile), tolerance_(tolerance) {}

  /// Means under the lobe, texel by texel.
  std::vector<Rgb> means() {
    choose();
    const auto directions = tiles_.directions(tile_);
    const std::vector<glm::vec3> texels(directions.begin(), directions.end());
    std::vector<LobeSum> sums(texels.size());
    add_tiles(lobe_.texels, summing_, Summing::at_texels, texels, lobe_.exponent, sums);
    if (lobe_.smooth)
      add_points(sums);
    std::vector<Rgb> means;
    for (const LobeSum& s : sums)
      means.push_back(glm::max(Rgb(glm::dvec3(s.red, s.green, s.blue) / s.weight), Rgb(0.0f)));
    return means;
  }

private:
  void choose();
  void relate(std::span<float> lobe_bound) const;
  void estimate(const PairBounds& bounds);
  void add_points(std::span<LobeSum> sums) const;

  const LobeSource& lobe_;
  const Tiles& tiles_;
  std::size_t tile_;
  double tolerance_;
  double least_[4] = {}; ///< of the tile's sums: red, green, blue, weight
  std::vector<Summing> summing_;
};

/// Sums at the middle and the corners of the tile, of the coarse texels within five standard deviations; half the
/// smallest.
void ExactTile::estimate(const PairBounds& bounds) {
  const auto w = tiles_.directions(tile_);
  std::vector<glm::vec3> points{glm::vec3(tiles_.frames[tile_].centre)};
  for (const std::uint32_t corner : tiles_.frames[tile_].corner)
    points.emplace_back(w[corner]);
  const double reach = std::min(1.5, 5.0 / std::sqrt(static_cast<double>(lobe_.exponent)));
  const float farthest = static_cast<float>(std::cos(reach));
  std::vector<Summing> near;
  for (const float cosine : bounds.cosine)
    near.push_back(cosine >= farthest ? Summing::at_texels : Summing::skipped);
  std::vector<LobeSum> sums(points.size());
  add_tiles(lobe_.coarse, near, Summing::at_texels, points, lobe_.exponent, sums);
  for (int c = 0; c < 4; ++c) {
    double least = std::numeric_limits<double>::infinity();
    for (const LobeSum& s : sums)
      least = std::min(least, c == 0 ? s.red : c == 1 ? s.green : c == 2 ? s.blue : s.weight);
    least_[c] = std::max(0.5 * least, lobe_.smallest[c]);
  }
}

/// What a source tile can add to a texel, relative to it, when the lobe is at most `lobe_bound` there: the worst
/// channel. In place.
void ExactTile::relate(std::span<float> lobe_bound) const {
  const double of_weight = static_cast<double>(lobe_.texels.per_tile) / least_[3];
  const glm::dvec3 scale(1.0 / least_[0], 1.0 / least_[1], 1.0 / least_[2]);
  for (std::size_t t = 0; t < lobe_bound.size(); ++t) {
    const glm::dvec3 share = lobe_.sum[t] * scale;
    lobe_bound[t] *= static_cast<float>(std::max({share.r, share.g, share.b, of_weight}));
  }
}

/// Skips the tiles that can add least, sums at points those that lose least by it, and at texels the rest.
void ExactTile::choose() {
  const std::size_t count = lobe_.tiles.frames.size();
  const PairBounds bounds = pair_bounds(tiles_.frames[tile_], lobe_.tiles, lobe_.smooth ? &*lobe_.smooth : nullptr);
  estimate(bounds);
  std::vector<float> bound(count);
  lobe_powers(bounds.cosine, lobe_.exponent, bound);
  relate(bound);
  const float skip = affordable(bound, kShare * tolerance_);
  summing_.resize(count);
  for (std::size_t t = 0; t < count; ++t)
    summing_[t] = bound[t] < skip ? Summing::skipped : Summing::at_texels;
  if (!lobe_.smooth)
    return;
  lobe_powers(bounds.ellipse, 0.5f * lobe_.exponent, bound);
  for (std::size_t t = 0; t < count; ++t)
    bound[t] = summing_[t] == Summing::skipped ? 0.0f
               : bounds.ellipse[t] < 0.0f      ? std::numeric_limits<float>::infinity()
                                               : bound[t] * static_cast<float>(lobe_.smooth->error_at_0);
  relate(bound);
  const float at_points = affordable(bound, kShare * tolerance_);
  for (std::size_t t = 0; t < count; ++t)
    if (summing_[t] == Summing::at_texels && bound[t] < at_points)
      summing_[t] = Summing::at_points;
}

void ExactTile::add_points(std::span<LobeSum> sums) const {
  const auto points = chebyshev_points(tiles_.frames[tile_], *lobe_.chebyshev);
  std::vector<LobeSum> at_points(points.size());
  add_tiles(lobe_.points, summing_, Summing::at_points, points, lobe_.exponent, at_points);
  const TileInterpolation to(tiles_, tile_, *lobe_.chebyshev);
  const std::size_t n = to.order;
  for (std::size_t i = 0; i < sums.size(); ++i)
    for (std::size_t p = 0; p < n; ++p)
      for (std::size_t q = 0; q < n; ++q) {
        const double weight = to.along[0][i * n + p] * to.along[1][i * n + q];
        const LobeSum& s = at_points[p * n + q];
        sums[i].red += weight * s.red;
        sums[i].green += weight * s.green;
        sums[i].blue += weight * s.blue;
        sums[i].weight += weight * s.weight;
      }
}

} // namespace

/// Lobe by lobe, tile by tile.
void exact_lobes(const PrefilterJob& job) {
  const Source source(job.source);
  std::map<int, TexelOrder> orders;
  for (std::size_t k = 0; k < job.lobes.size() && !job.options.stop.stop_requested(); ++k) {
    const Lobe& lobe = job.lobes[k];
    const TexelOrder& order =
        lobe.side == job.source.side ? source.order : orders.try_emplace(lobe.side, job.maps[k]).first->second;
    const std::size_t per_tile = tile_texels(source, lobe, job.options.tolerance);
    const LobeSource from(source, lobe, per_tile, job.options.tolerance);
    const Tiles tiles(order, std::min(per_tile, order.texel.size()));
    parallel_for(std::size_t(0), tiles.frames.size(), [&](std::size_t t) {
      if (job.options.stop.stop_requested())
        return;
      const std::vector<Rgb> means = ExactTile(from, tiles, t, job.options.tolerance).means();
      for (std::size_t i = 0; i < means.size(); ++i)
        job.maps[k].radiance[tiles.texels_of(t)[i]] = means[i];
      if (job.options.tile_done)
        job.options.tile_done({k, tiles.texels_of(t)}, job.maps[k]);
    });
  }
}

} // namespace daylit::detail
