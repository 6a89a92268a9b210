#include "scene/detail/local_sky.h"

#include <algorithm>

#include <tbb/parallel_for.h>

#include "scene/detail/tile_kernels.h"

namespace daylit::detail {

namespace {

#define DAYLIT_ANY_WIDTH __attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")))

constexpr std::uint32_t kLargestGap = 8; ///< of unlit regions inside a run

/// Calls visit(source, region, weight) for every number of the first light of a colour.
template <class Visit>
void for_each_weight(const CompactBasis& basis, std::size_t table, const Visit& visit) {
  const FirstLight& light = basis.light;
  for (std::size_t s = 0; s < basis.sources; ++s) {
    const std::size_t row = table * basis.sources + s;
    std::size_t at = light.first_weight[row];
    for (std::uint32_t r = light.first_run[row]; r < light.first_run[row + 1]; ++r)
      for (std::uint32_t k = 0; k < light.run[r].count; ++k, ++at)
        visit(s, light.run[r].first_region + k, light.scale[row] * from_half(light.weight[at]));
  }
}

void find_runs(LocalSkyData& sky) {
  std::vector<std::uint8_t> lit(sky.regions, 0);
  for (const FirstLight::Run& run : sky.basis->light.run)
    std::fill_n(lit.begin() + run.first_region, run.count, std::uint8_t{1});
  for (std::uint32_t r = 0; r < lit.size(); ++r) {
    if (lit[r] == 0)
      continue;
    if (sky.run.empty() || r - (sky.run.back().first_region + sky.run.back().count) > kLargestGap ||
        r - sky.run.back().first_region >= kLaneRegions)
      sky.run.push_back({r, 0});
    sky.run.back().count = r + 1 - sky.run.back().first_region;
  }
  for (const FirstLight::Run& run : sky.run)
    sky.rows += run.count;
}

LocalSkyData::Table sort_by_region(const LocalSkyData& sky, std::size_t colour) {
  std::vector<std::uint32_t> row(sky.regions, 0);
  std::uint32_t next = 0;
  for (const FirstLight::Run& run : sky.run)
    for (std::uint32_t k = 0; k < run.count; ++k)
      row[run.first_region + k] = next++;
  LocalSkyData::Table table;
  table.first.assign(sky.rows + 1, 0);
  for_each_weight(*sky.basis, colour,
                  [&](std::size_t, std::uint32_t region, float) { ++table.first[row[region] + 1]; });
  for (std::size_t r = 0; r < sky.rows; ++r)
    table.first[r + 1] += table.first[r];
  table.weight.resize(table.first.back());
  std::vector<std::uint32_t> to(table.first.begin(), table.first.end() - 1);
  for_each_weight(*sky.basis, colour, [&](std::size_t s, std::uint32_t region, float weight) {
    table.weight[to[row[region]]++] = {static_cast<std::uint32_t>(s), weight};
  });
  return table;
}

/// to[k] += x * from[k] for kSketch numbers.
DAYLIT_ANY_WIDTH void add_scaled(float x, const float* from, float* to) {
  for (std::size_t k = 0; k < kSketch; ++k)
    to[k] += x * from[k];
}

/// Random skies: a sign for each region, of a fixed sequence.
std::vector<float> random_skies(std::size_t regions) {
  static_assert(kSketch == 64);
  std::vector<float> signs(regions * kSketch);
  for (std::uint64_t r = 0; r < regions; ++r) {
    std::uint64_t x = (r + 1) * 0x9E3779B97F4A7C15ull;
    x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ull;
    x ^= x >> 27;
    for (std::size_t k = 0; k < kSketch; ++k)
      signs[r * kSketch + k] = (x >> k & 1u) != 0 ? 1.0f : -1.0f;
  }
  return signs;
}

/// seen[component] += number * light[source] for the 128 components of a tile.
template <class Number, class ToFloat>
void add_tile(const Number* tile, std::size_t components, const std::vector<float>& light, const ToFloat& to_float,
              float* seen) {
  for (std::size_t s = 0; s < light.size() / kSketch; ++s)
    for (std::size_t k = 0; k < components; ++k)
      if (const Number x = tile[s * kTileNumbers + k]; x != 0)
        add_scaled(to_float(x), light.data() + s * kSketch, seen + k * kSketch);
}

template <class Number, class ToFloat>
std::vector<float> all_seen(const std::vector<Number>& factor, std::span<const float> scale,
                            const std::vector<float>& light, const ToFloat& to_float) {
  std::vector<float> seen(scale.size() * kSketch, 0.0f);
  const std::size_t tiles = (scale.size() + kTileNumbers - 1) / kTileNumbers,
                    stride = light.size() / kSketch * kTileNumbers;
  tbb::parallel_for(std::size_t{0}, tiles, [&](std::size_t t) {
    add_tile(factor.data() + t * stride, std::min(kTileNumbers, scale.size() - t * kTileNumbers), light, to_float,
             seen.data() + t * kTileNumbers * kSketch);
  });
  for (std::size_t k = 0; k < seen.size(); ++k)
    seen[k] *= scale[k / kSketch];
  return seen;
}

/// Components of one brick that holds wanted probes.
struct Piece {
  std::size_t brick, half, byte, probe_half, probe_byte;  ///< where its components and numbers begin
  std::vector<std::pair<std::size_t, std::size_t>> probe; ///< place in the brick, place in the result
};

std::vector<Piece> find_pieces(const CompactFactors& basis, std::span<const std::uint32_t> wanted) {
  std::vector<Piece> pieces;
  Piece at{};
  std::size_t first = 0;
  for (std::size_t b = 0; b < basis.brick.size(); ++b) {
    const CompactFactors::Brick& brick = basis.brick[b];
    Piece piece = at;
    piece.brick = b;
    for (std::size_t i = 0; i < brick.probes; ++i)
      for (std::size_t k = 0; k < wanted.size(); ++k)
        if (basis.probe[first + i] == wanted[k])
          piece.probe.emplace_back(i, k);
    if (!piece.probe.empty())
      pieces.push_back(std::move(piece));
    const std::size_t column = 3 * brick.tiles() * kTileNumbers;
    first += brick.probes;
    at.half += brick.half_rank;
    at.byte += brick.byte_rank;
    at.probe_half += column * brick.half_rank;
    at.probe_byte += column * brick.byte_rank;
  }
  return pieces;
}

/// Copies the components of a brick that are half floats, or bytes, to those of `f` from `to` on.
template <class Number, class ToFloat>
void copy_components(const LocalSkyData& sky, const Piece& piece, std::size_t to, const std::vector<Number>& source,
                     const std::vector<Number>& probe, const std::vector<float>& seen, const ToFloat& to_float,
                     LocalFactors& f) {
  constexpr bool kHalf = sizeof(Number) == 2;
  const CompactFactors& basis = sky.basis->nine;
  const CompactFactors::Brick& brick = basis.brick[piece.brick];
  const std::size_t all = kHalf ? piece.half : piece.byte, rank = kHalf ? brick.half_rank : brick.byte_rank,
                    numbers = kHalf ? piece.probe_half : piece.probe_byte;
  const float* const scale = (kHalf ? basis.half_scale : basis.byte_scale).data() + all;
  for (std::size_t s = 0; s < f.sources; ++s)
    for (std::size_t k = 0; k < rank; ++k) {
      const std::size_t tile = (all + k) / kTileNumbers, in_tile = (all + k) % kTileNumbers;
      f.source[s * f.components + to + k] =
          scale[k] * to_float(source[(tile * f.sources + s) * kTileNumbers + in_tile]);
    }
  std::copy_n(seen.data() + all * kSketch, rank * kSketch, f.seen.data() + to * kSketch);
  for (const auto& [in_brick, in_result] : piece.probe)
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t l = 0; l < 9; ++l) {
        const std::size_t n = in_brick * 9 + l, tile = c * brick.tiles() + n / kTileNumbers;
        for (std::size_t k = 0; k < rank; ++k)
          f.probe[c][(in_result * 9 + l) * f.components + to + k] =
              to_float(probe[numbers + (tile * rank + k) * kTileNumbers + n % kTileNumbers]);
      }
}

const auto kByteToFloat = [](std::int8_t x) { return static_cast<float>(x); };

} // namespace

LocalSkyData make_local_sky(std::shared_ptr<const CompactBasis> basis, std::size_t probes, std::size_t regions) {
  LocalSkyData sky;
  sky.basis = std::move(basis);
  sky.probes = probes;
  sky.regions = regions;
  find_runs(sky);
  const CompactBasis& b = *sky.basis;
  for (std::size_t colour = 0; colour < (b.light.rows() > b.sources ? 3 : 1); ++colour)
    sky.table.push_back(sort_by_region(sky, colour));
  const std::vector<float> skies = random_skies(regions);
  std::vector<float> light(b.sources * kSketch, 0.0f);
  for_each_weight(b, 0, [&](std::size_t s, std::uint32_t region, float weight) {
    add_scaled(weight, skies.data() + region * kSketch, light.data() + s * kSketch);
  });
  sky.half_seen = all_seen(b.nine.source_half, b.nine.half_scale, light, from_half);
  sky.byte_seen = all_seen(b.nine.source_byte, b.nine.byte_scale, light, kByteToFloat);
  return sky;
}

LocalFactors local_factors(const LocalSkyData& sky, std::span<const std::uint32_t> wanted) {
  const CompactFactors& basis = sky.basis->nine;
  const std::vector<Piece> pieces = find_pieces(basis, wanted);
  LocalFactors f{.numbers = wanted.size() * 9,
                 .components = 0,
                 .sources = sky.basis->sources,
                 .probe = {},
                 .source = {},
                 .seen = {}};
  for (const Piece& p : pieces)
    f.components += basis.brick[p.brick].half_rank + basis.brick[p.brick].byte_rank;
  for (std::vector<float>& colour : f.probe)
    colour.assign(f.numbers * f.components, 0.0f);
  f.source.resize(f.components * f.sources);
  f.seen.resize(f.components * kSketch);
  std::size_t to = 0;
  for (const Piece& p : pieces) {
    const CompactFactors::Brick& brick = basis.brick[p.brick];
    copy_components(sky, p, to, basis.source_half, basis.probe_half, sky.half_seen, from_half, f);
    copy_components(sky, p, to + brick.half_rank, basis.source_byte, basis.probe_byte, sky.byte_seen, kByteToFloat, f);
    to += brick.half_rank + brick.byte_rank;
  }
  return f;
}

} // namespace daylit::detail
