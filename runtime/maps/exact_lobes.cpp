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

/// Tiles side by side that are summed in one go: long sums in float lose digits.
constexpr std::size_t kRun = 8;
/// Of the tolerance, that skipped tiles may cost, and tiles summed at points.
constexpr double kShare = 0.4;
/// Below this part of the mean of the map a texel's error is relative to that.
constexpr double kFloor = 1e-6;

/// What a lobe needs of the source.
struct LobeSource {
  float exponent = 1.0f;
  TiledCharges coarse; ///< texels about half as wide as the lobe's standard deviation, in the same tiles
  double texels_per_coarse = 1.0;
  double smallest[4] = {}; ///< red, green, blue, weight: what a sum is taken to be at least
  std::optional<SmoothLobe> smooth;
  std::optional<Chebyshev> chebyshev;
  TiledCharges points;
};

struct Source {
  const RadianceMap& map;
  MapTiles tiles;
  TiledCharges texels;

  explicit Source(const RadianceMap& m) : map(m), tiles(m.side), texels(texel_charges(m, tiles)) {}
};

RadianceMap coarse_map(const Source& source, double exponent) {
  const int least = source.map.side / source.tiles.side * 4;
  RadianceMap map = source.map;
  while (map.side / 2 >= least && std::sqrt(4.0 * std::numbers::pi * exponent) / (map.side / 2) < 0.5)
    map = halved(map);
  return map;
}

LobeSource lobe_source(const Source& source, double exponent, double half, double tolerance) {
  LobeSource out;
  out.exponent = static_cast<float>(exponent);
  const RadianceMap coarse = coarse_map(source, exponent);
  out.coarse = texel_charges(coarse, MapTiles(coarse.side, coarse.side * source.tiles.side / source.map.side));
  out.texels_per_coarse = std::pow(static_cast<double>(source.map.side) / coarse.side, 2);
  glm::dvec3 whole(0.0);
  for (const glm::dvec3& s : source.texels.sum)
    whole += s;
  // integral of the lobe over the sphere: 2 pi / (exponent + 1) of 4 pi
  for (int c = 0; c < 3; ++c)
    out.smallest[c] = std::max(kFloor * whole[c] / (2.0 * exponent + 2.0), std::numeric_limits<double>::min());
  out.smooth = smooth_lobe(exponent, half, source.tiles.texels(), kShare * tolerance / 100.0);
  if (out.smooth) {
    out.chebyshev.emplace(out.smooth->order);
    out.points = point_charges(source.map, source.tiles, *out.chebyshev);
  }
  return out;
}

/// body(first, count) for runs of tiles that are summed in the given way.
template <class Body>
void for_each_run(std::span<const Summing> summing, Summing way, const Body& body) {
  for (std::size_t t = 0; t < summing.size();) {
    std::size_t end = t;
    while (end < summing.size() && end < t + kRun && summing[end] == way)
      ++end;
    if (end > t)
      body(t, end - t);
    t = std::max(end, t + 1);
  }
}

void add_tiles(const TiledCharges& from, std::span<const Summing> summing, Summing way,
               std::span<const glm::vec3> points, float exponent, std::span<LobeSum> sums) {
  for_each_run(summing, way, [&](std::size_t first, std::size_t count) {
    add_lobe(from.charges, first * from.per_tile, count * from.per_tile, points, exponent, sums);
  });
}

/// One tile of one blurred map.
class ExactTile {
public:
  ExactTile(const Source& source, const LobeSource& lobe, const MapTiles& tiles, std::size_t tile, double tolerance)
      : source_(source), lobe_(lobe), tiles_(tiles), tile_(tile), tolerance_(tolerance) {}

  /// Means under the lobe, texel by texel.
  std::vector<Rgb> means() {
    choose();
    const auto directions = tiles_.directions_of(tile_);
    const std::vector<glm::vec3> texels(directions.begin(), directions.end());
    std::vector<LobeSum> sums(texels.size());
    add_tiles(source_.texels, summing_, Summing::at_texels, texels, lobe_.exponent, sums);
    if (lobe_.smooth)
      add_points(sums);
    std::vector<Rgb> means;
    for (const LobeSum& s : sums)
      means.push_back(glm::max(Rgb(glm::dvec3(s.red, s.green, s.blue) / s.weight), Rgb(0.0f)));
    return means;
  }

private:
  void choose();
  std::vector<float> shares(std::span<const float> lobe_bound) const;
  void estimate(const PairBounds& bounds);
  void add_points(std::span<LobeSum> sums) const;

  const Source& source_;
  const LobeSource& lobe_;
  const MapTiles& tiles_;
  std::size_t tile_;
  double tolerance_;
  double least_[4] = {}; ///< of the tile's sums: red, green, blue, weight
  std::vector<Summing> summing_;
};

/// Sums at five texels of the tile, of the coarse texels within five standard deviations; half the smallest.
void ExactTile::estimate(const PairBounds& bounds) {
  const auto w = tiles_.directions_of(tile_);
  const std::size_t n = static_cast<std::size_t>(tiles_.side);
  const glm::vec3 points[5] = {glm::vec3(w[0]), glm::vec3(w[n - 1]), glm::vec3(w[n * (n - 1)]), glm::vec3(w[n * n - 1]),
                               glm::vec3(tiles_.tiles[tile_].centre)};
  const double reach = std::min(1.5, 5.0 / std::sqrt(static_cast<double>(lobe_.exponent)));
  const float farthest = static_cast<float>(std::log2(std::cos(reach)));
  std::vector<Summing> near;
  for (const float cosine : bounds.cosine)
    near.push_back(cosine >= farthest ? Summing::at_texels : Summing::skipped);
  LobeSum sums[5];
  add_tiles(lobe_.coarse, near, Summing::at_texels, points, lobe_.exponent, sums);
  for (int c = 0; c < 4; ++c) {
    double least = std::numeric_limits<double>::infinity();
    for (const LobeSum& s : sums)
      least = std::min(least, c == 0 ? s.red : c == 1 ? s.green : c == 2 ? s.blue : s.weight);
    least_[c] = std::max(0.5 * least * lobe_.texels_per_coarse, lobe_.smallest[c]);
  }
}

/// What a source tile can add to a texel, relative to it, when the lobe is at most `lobe_bound` there: the worst
/// channel.
std::vector<float> ExactTile::shares(std::span<const float> lobe_bound) const {
  std::vector<float> bounds(lobe_bound.size());
  const double of_weight = static_cast<double>(source_.texels.per_tile) / least_[3];
  for (std::size_t t = 0; t < bounds.size(); ++t) {
    const glm::dvec3& sum = source_.texels.sum[t];
    const double most = std::max({sum.r / least_[0], sum.g / least_[1], sum.b / least_[2], of_weight});
    bounds[t] = static_cast<float>(static_cast<double>(lobe_bound[t]) * most);
  }
  return bounds;
}

/// Skips the tiles that can add least, sums at points those that lose least by it, and at texels the rest.
void ExactTile::choose() {
  const std::size_t count = source_.tiles.tiles.size();
  const PairBounds bounds = pair_bounds(tiles_.tiles[tile_], source_.tiles, lobe_.smooth ? &*lobe_.smooth : nullptr);
  estimate(bounds);
  std::vector<float> power(count);
  lobe_powers(bounds.cosine, lobe_.exponent, power);
  const std::vector<float> adds = shares(power);
  const double skip = affordable(adds, kShare * tolerance_);
  summing_.resize(count);
  for (std::size_t t = 0; t < count; ++t)
    summing_[t] = static_cast<double>(adds[t]) < skip ? Summing::skipped : Summing::at_texels;
  if (!lobe_.smooth)
    return;
  lobe_powers(bounds.ellipse, lobe_.exponent, power);
  for (std::size_t t = 0; t < count; ++t)
    power[t] = summing_[t] == Summing::skipped ? 0.0f
               : bounds.ellipse[t] <= 0.0f     ? power[t] * static_cast<float>(lobe_.smooth->error_at_0)
                                               : std::numeric_limits<float>::infinity();
  const std::vector<float> loses = shares(power);
  const double at_points = affordable(loses, kShare * tolerance_);
  for (std::size_t t = 0; t < count; ++t)
    if (summing_[t] == Summing::at_texels && static_cast<double>(loses[t]) < at_points)
      summing_[t] = Summing::at_points;
}

void ExactTile::add_points(std::span<LobeSum> sums) const {
  const auto directions = chebyshev_points(tiles_.tiles[tile_], *lobe_.chebyshev);
  const std::vector<glm::vec3> points(directions.begin(), directions.end());
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
  std::map<int, MapTiles> by_side;
  for (std::size_t k = 0; k < job.lobes.size() && !job.options.stop.stop_requested(); ++k) {
    const Lobe& lobe = job.lobes[k];
    const MapTiles& tiles = by_side.try_emplace(lobe.side, lobe.side).first->second;
    const double half = std::max(tiles.largest_half(), source.tiles.largest_half());
    const LobeSource of_lobe = lobe_source(source, lobe.exponent, half, job.options.tolerance);
    parallel_for(std::size_t(0), tiles.tiles.size(), [&](std::size_t t) {
      if (job.options.stop.stop_requested())
        return;
      const std::vector<Rgb> means = ExactTile(source, of_lobe, tiles, t, job.options.tolerance).means();
      for (std::size_t i = 0; i < means.size(); ++i)
        job.maps[k].radiance[tiles.texel(t, i)] = means[i];
      const int across = lobe.side / tiles.side, at = static_cast<int>(t);
      if (job.options.tile_done)
        job.options.tile_done({k, at % across * tiles.side, at / across * tiles.side, tiles.side}, job.maps[k]);
    });
  }
}

} // namespace daylit::detail
