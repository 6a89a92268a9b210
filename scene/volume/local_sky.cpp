#include "scene/volume/local_sky.h"

#include <algorithm>

#include "scene/core/parallel.h"

namespace daylit::detail {

namespace {

#define DAYLIT_ANY_WIDTH __attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")))

/// Calls visit(source, region, weight) for every number of the first light of a colour.
template <class Visit>
void for_each_weight_of(const CompactBasis& basis, std::size_t colour, const Visit& visit) {
  for (std::size_t s = 0; s < basis.sources; ++s)
    for_each_weight(basis.light, colour * basis.sources + s,
                    [&](std::size_t region, float weight) { visit(s, region, weight); });
}

void find_runs(LocalSkyData& sky) {
  const std::vector<std::uint8_t> lit = lit_regions(sky.basis->light, sky.regions);
  for (std::uint32_t r = 0; r < lit.size(); ++r) {
    if (lit[r] == 0)
      continue;
    if (sky.rows % kChunkRows == 0 || r != sky.run.back().first_region + sky.run.back().count)
      sky.run.push_back({r, 0});
    ++sky.run.back().count;
    ++sky.rows;
  }
}

LocalSkyData::Table sort_by_region(const LocalSkyData& sky, std::size_t colour) {
  std::vector<std::uint32_t> row(sky.regions, 0);
  std::uint32_t next = 0;
  for (const LocalSkyData::Run& run : sky.run)
    for (std::uint32_t k = 0; k < run.count; ++k)
      row[run.first_region + k] = next++;
  LocalSkyData::Table table;
  table.first.assign(sky.rows + 1, 0);
  for_each_weight_of(*sky.basis, colour,
                     [&](std::size_t, std::size_t region, float) { ++table.first[row[region] + 1]; });
  for (std::size_t r = 0; r < sky.rows; ++r)
    table.first[r + 1] += table.first[r];
  table.weight.resize(table.first.back());
  std::vector<std::uint32_t> to(table.first.begin(), table.first.end() - 1);
  for_each_weight_of(*sky.basis, colour, [&](std::size_t s, std::size_t region, float weight) {
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

/// A component of a brick, a word or a byte.
struct Component {
  const CompactFactors& factors;
  const CompactFactors::Brick& brick;
  const BrickPlace& at;
  std::size_t k;

  bool is_word() const { return k < brick.word_rank; }
  std::size_t plane() const { return is_word() ? k : brick.word_rank + k; } ///< of a word: of its high bytes
  float source(std::size_t piece) const {
    const std::int8_t* from = factors.source_factor.data() + at.source_byte;
    return value(from, brick.source_at(plane(), piece), brick.source_at(brick.word_rank + k, piece)) *
           factors.scale[at.component + k];
  }
  float probe(std::size_t channel, std::size_t number) const {
    const std::int8_t* from = factors.probe_factor.data() + at.probe_byte;
    return value(from, brick.probe_at(plane(), channel, number), brick.probe_at(brick.word_rank + k, channel, number));
  }
  float value(const std::int8_t* from, std::size_t first, std::size_t low) const {
    return is_word() ? 256.0f * static_cast<float>(from[first]) + static_cast<float>(from[low])
                     : static_cast<float>(from[first]);
  }
};

/// Calls visit(source, weight) for the sources of a piece.
template <class Visit>
void for_each_source(const CompactBasis& basis, std::uint32_t piece, const Visit& visit) {
  if (piece < basis.sources)
    return visit(piece, 1.0f);
  const CompactBasis::Group& group = basis.group[piece - basis.sources];
  for (std::uint32_t s = group.first; s < group.end; ++s)
    visit(s, basis.group_weight[s]);
}

/// Random skies seen by all components of a brick; `light`: on the sources and the groups.
void add_seen(const CompactFactors& factors, const CompactFactors::Brick& brick, const BrickPlace& at,
              const std::vector<float>& light, float* seen) {
  for (std::size_t i = 0; i < brick.pieces; ++i)
    for (std::size_t k = 0; k < brick.rank(); ++k)
      if (const float x = Component{factors, brick, at, k}.source(i); x != 0.0f)
        add_scaled(x, light.data() + factors.piece[at.piece + i] * kSketch, seen + k * kSketch);
}

std::vector<float> all_seen(const CompactBasis& basis, const std::vector<float>& light_on_sources) {
  std::vector<float> light = light_on_sources;
  for (const CompactBasis::Group& g : basis.group) {
    light.resize(light.size() + kSketch, 0.0f);
    for (std::size_t s = g.first; s < g.end; ++s)
      add_scaled(basis.group_weight[s], light.data() + s * kSketch, light.data() + light.size() - kSketch);
  }
  const CompactFactors& nine = basis.nine;
  const std::vector<BrickPlace> at = brick_places(nine);
  std::vector<float> seen(nine.scale.size() * kSketch, 0.0f);
  parallel_for(std::size_t{0}, nine.brick.size(), [&](std::size_t b) {
    add_seen(nine, nine.brick[b], at[b], light, seen.data() + at[b].component * kSketch);
  });
  return seen;
}

/// A brick that holds wanted probes.
struct WantedBrick {
  std::size_t brick;
  std::vector<std::pair<std::size_t, std::size_t>> probe; ///< place in the brick, place in the result
};

std::vector<WantedBrick> find_bricks(const CompactFactors& factors, std::span<const std::uint32_t> wanted) {
  std::vector<WantedBrick> bricks;
  std::size_t first = 0;
  for (std::size_t b = 0; b < factors.brick.size(); ++b) {
    WantedBrick wanted_brick{b, {}};
    for (std::size_t i = 0; i < factors.brick[b].probes; ++i)
      for (std::size_t k = 0; k < wanted.size(); ++k)
        if (factors.probe[first + i] == wanted[k])
          wanted_brick.probe.emplace_back(i, k);
    if (!wanted_brick.probe.empty())
      bricks.push_back(std::move(wanted_brick));
    first += factors.brick[b].probes;
  }
  return bricks;
}

/// Copies the components of a brick to those of `f` from `to` on.
void copy_components(const LocalSkyData& sky, const WantedBrick& wanted, const BrickPlace& at, std::size_t to,
                     LocalFactors& f) {
  const CompactFactors& factors = sky.basis->nine;
  const CompactFactors::Brick& brick = factors.brick[wanted.brick];
  std::copy_n(sky.seen.data() + at.component * kSketch, brick.rank() * kSketch, f.seen.data() + to * kSketch);
  std::vector<float> of_piece(brick.rank());
  for (std::size_t i = 0; i < brick.pieces; ++i) {
    for (std::size_t k = 0; k < brick.rank(); ++k)
      of_piece[k] = Component{factors, brick, at, k}.source(i);
    for_each_source(*sky.basis, factors.piece[at.piece + i], [&](std::size_t s, float weight) {
      for (std::size_t k = 0; k < brick.rank(); ++k)
        f.source[s * f.components + to + k] += weight * of_piece[k];
    });
  }
  for (const auto& [in_brick, in_result] : wanted.probe)
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t l = 0; l < 9; ++l)
        for (std::size_t k = 0; k < brick.rank(); ++k)
          f.probe[c][(in_result * 9 + l) * f.components + to + k] =
              Component{factors, brick, at, k}.probe(c, in_brick * 9 + l);
}

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
  for_each_weight_of(b, 0, [&](std::size_t s, std::size_t region, float weight) {
    add_scaled(weight, skies.data() + region * kSketch, light.data() + s * kSketch);
  });
  sky.seen = all_seen(b, light);
  return sky;
}

LocalFactors local_factors(const LocalSkyData& sky, std::span<const std::uint32_t> wanted) {
  const CompactFactors& basis = sky.basis->nine;
  const std::vector<WantedBrick> bricks = find_bricks(basis, wanted);
  LocalFactors f{.numbers = wanted.size() * 9,
                 .components = 0,
                 .sources = sky.basis->sources,
                 .probe = {},
                 .source = {},
                 .seen = {}};
  for (const WantedBrick& b : bricks)
    f.components += basis.brick[b.brick].rank();
  for (std::vector<float>& colour : f.probe)
    colour.assign(f.numbers * f.components, 0.0f);
  f.source.resize(f.components * f.sources);
  f.seen.resize(f.components * kSketch);
  const std::vector<BrickPlace> at = brick_places(basis);
  std::size_t to = 0;
  for (const WantedBrick& b : bricks) {
    copy_components(sky, b, at[b.brick], to, f);
    to += basis.brick[b.brick].rank();
  }
  return f;
}

} // namespace daylit::detail
