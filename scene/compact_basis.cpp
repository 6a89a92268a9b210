#include "scene/compact_basis.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <tbb/parallel_for.h>

#include "scene/detail/tile_kernels.h"

namespace daylit {

namespace {

using detail::ColouredRow;
using detail::kTileBlocks;
using detail::kTileNumbers;
using detail::WeightedRow;

std::size_t tiles_of(std::size_t numbers) { return (numbers + kTileNumbers - 1) / kTileNumbers; }

/// Where a brick's parts begin.
struct Place {
  std::size_t probe = 0, half = 0, byte = 0;  ///< first probe, first component
  std::size_t probe_half = 0, probe_byte = 0; ///< first number of the probe factors
};

std::vector<Place> places(const CompactFactors& basis) {
  std::vector<Place> list(basis.brick.size() + 1);
  for (std::size_t b = 0; b < basis.brick.size(); ++b) {
    const CompactFactors::Brick& brick = basis.brick[b];
    const std::size_t column = 3 * brick.tiles() * kTileNumbers;
    list[b + 1] = {list[b].probe + brick.probes, list[b].half + brick.half_rank, list[b].byte + brick.byte_rank,
                   list[b].probe_half + column * brick.half_rank, list[b].probe_byte + column * brick.byte_rank};
  }
  return list;
}

/// Amplitude of every component per colour: the light on the sources seen by their factors.
struct Amplitudes {
  std::array<std::vector<float>, 3> half, byte; ///< whole tiles
};

/// The sources that are not in the dark.
std::vector<ColouredRow> lit_sources(std::span<const Rgb> irradiance) {
  std::vector<ColouredRow> rows;
  rows.reserve(irradiance.size());
  for (std::size_t i = 0; i < irradiance.size(); ++i)
    if (const Rgb& e = irradiance[i]; e != Rgb(0.0f))
      rows.push_back({static_cast<std::uint32_t>(i), {e.r, e.g, e.b}});
  return rows;
}

/// Marks the tiles of components [first, first + count).
void mark(std::vector<std::uint8_t>& tiles, std::size_t first, std::size_t count) {
  for (std::size_t t = first / kTileNumbers; count > 0 && t <= (first + count - 1) / kTileNumbers; ++t)
    tiles[t] = 1;
}

Amplitudes amplitudes(const CompactFactors& basis, std::size_t sources, const std::vector<ColouredRow>& rows,
                      const std::vector<std::uint8_t>& half_tiles, const std::vector<std::uint8_t>& byte_tiles) {
  Amplitudes a;
  for (std::size_t c = 0; c < 3; ++c) {
    a.half[c].assign(half_tiles.size() * kTileNumbers, 0.0f);
    a.byte[c].assign(byte_tiles.size() * kTileNumbers, 0.0f);
  }
  const detail::TileKernels& kernels = detail::tile_kernels();
  const std::size_t stride = sources * kTileNumbers;
  const detail::ByteRows byte_rows{std::span<const ColouredRow>(rows)};
  tbb::parallel_for(std::size_t{0}, half_tiles.size() + byte_tiles.size(), [&](std::size_t t) {
    const bool half = t < half_tiles.size();
    const std::size_t tile = half ? t : t - half_tiles.size();
    if ((half ? half_tiles : byte_tiles)[tile] == 0)
      return;
    auto& planes = half ? a.half : a.byte;
    float* const sum[3] = {planes[0].data() + tile * kTileNumbers, planes[1].data() + tile * kTileNumbers,
                           planes[2].data() + tile * kTileNumbers};
    if (half)
      kernels.add_half_colours(basis.source_half.data() + tile * stride, rows, sum);
    else
      kernels.add_bytes(basis.source_byte.data() + tile * stride, byte_rows, sum);
  });
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t k = 0; k < basis.half_scale.size(); ++k)
      a.half[c][k] *= basis.half_scale[k];
    for (std::size_t k = 0; k < basis.byte_scale.size(); ++k)
      a.byte[c][k] *= basis.byte_scale[k];
  }
  return a;
}

std::vector<WeightedRow> component_rows(const std::vector<float>& amplitude, std::size_t first, std::size_t count) {
  std::vector<WeightedRow> rows(count);
  for (std::size_t k = 0; k < count; ++k)
    rows[k] = {static_cast<std::uint32_t>(k), amplitude[first + k]};
  return rows;
}

void combine_brick(const CompactFactors& basis, const CompactFactors::Brick& brick, const Place& at,
                   const Amplitudes& a, std::span<Sh9Rgb> result) {
  const detail::TileKernels& kernels = detail::tile_kernels();
  const std::size_t tiles = brick.tiles(), plane = tiles * kTileNumbers;
  std::vector<float> sums(3 * plane, 0.0f), rgb(3 * plane);
  for (std::size_t c = 0; c < 3; ++c) {
    const std::vector<WeightedRow> half = component_rows(a.half[c], at.half, brick.half_rank),
                                   byte = component_rows(a.byte[c], at.byte, brick.byte_rank);
    const detail::ByteRows byte_rows{std::span<const WeightedRow>(byte)};
    for (std::size_t t = c * tiles; t < (c + 1) * tiles; ++t) {
      kernels.add_half(basis.probe_half.data() + at.probe_half + t * brick.half_rank * kTileNumbers, half, 0,
                       kTileBlocks, sums.data() + t * kTileNumbers);
      float* const sum = sums.data() + t * kTileNumbers;
      kernels.add_bytes(basis.probe_byte.data() + at.probe_byte + t * brick.byte_rank * kTileNumbers, byte_rows, &sum);
    }
  }
  kernels.interleave(sums.data(), sums.data() + plane, sums.data() + 2 * plane, std::size_t{brick.probes} * 9,
                     rgb.data());
  for (std::size_t p = 0; p < brick.probes; ++p)
    std::copy_n(rgb.data() + 27 * p, 27, &result[basis.probe[at.probe + p]][0].x);
}

void combine_bricks(const CompactFactors& basis, std::size_t sources, const std::vector<ColouredRow>& lit,
                    const std::vector<std::uint8_t>& bricks, std::span<std::array<Rgb, 9>> result) {
  const std::vector<Place> at = places(basis);
  std::vector<std::uint8_t> half_tiles(tiles_of(basis.half_scale.size()), 0),
      byte_tiles(tiles_of(basis.byte_scale.size()), 0);
  for (std::size_t b = 0; b < bricks.size(); ++b)
    if (bricks[b] != 0) {
      mark(half_tiles, at[b].half, basis.brick[b].half_rank);
      mark(byte_tiles, at[b].byte, basis.brick[b].byte_rank);
    }
  const Amplitudes a = amplitudes(basis, sources, lit, half_tiles, byte_tiles);
  tbb::parallel_for(std::size_t{0}, bricks.size(), [&](std::size_t b) {
    if (bricks[b] != 0)
      combine_brick(basis, basis.brick[b], at[b], a, result);
  });
}

Error broken(const char* what) {
  return {ErrorCode::file_malformed, what, "compact basis", "bake it again with daylit-precompute"};
}

} // namespace

std::size_t CompactFactors::bytes() const {
  return source_half.size() * 2 + source_byte.size() + probe_half.size() * 2 + probe_byte.size() +
         4 * (probe.size() + 3 * brick.size() + half_scale.size() + byte_scale.size());
}

std::size_t CompactBasis::bytes() const { return light.bytes() + nine.bytes() + band4.bytes(); }

void combine(const CompactBasis& basis, std::span<const Rgb> region_radiance, std::span<Sh9Rgb> result,
             std::span<Band4Rgb> band4) {
  const std::vector<ColouredRow> lit = lit_sources(received(basis.light, basis.sources, region_radiance));
  const auto all = [&](const CompactFactors& factors, std::span<std::array<Rgb, 9>> numbers) {
    combine_bricks(factors, basis.sources, lit, std::vector<std::uint8_t>(factors.brick.size(), 1), numbers);
  };
  all(basis.nine, result);
  if (!band4.empty())
    all(basis.band4, band4);
}

void combine_at(const CompactBasis& basis, std::span<const Rgb> region_radiance, std::span<const std::uint32_t> wanted,
                std::span<Sh9Rgb> result) {
  const CompactFactors& nine = basis.nine;
  std::vector<std::uint8_t> is_wanted(result.size(), 0), bricks(nine.brick.size(), 0);
  for (const std::uint32_t p : wanted)
    is_wanted[p] = 1;
  std::size_t next = 0;
  for (std::size_t b = 0; b < bricks.size(); ++b)
    for (const std::size_t end = next + nine.brick[b].probes; next < end; ++next)
      bricks[b] |= is_wanted[nine.probe[next]];
  combine_bricks(nine, basis.sources, lit_sources(received(basis.light, basis.sources, region_radiance)), bricks,
                 result);
}

namespace {

Result<void> check_factors(const CompactFactors& basis, std::size_t sources, std::size_t probes) {
  std::vector<std::uint8_t> seen(probes, 0);
  for (const std::uint32_t p : basis.probe) {
    if (p >= probes || seen[p] != 0)
      return broken("a brick names a probe that does not exist, or one twice");
    seen[p] = 1;
  }
  // Sums of products of 32-bit numbers: double is exact enough to refuse what does not fit, and does not overflow.
  double sizes[5] = {};
  for (const CompactFactors::Brick& b : basis.brick) {
    const double column = 3.0 * static_cast<double>(b.tiles() * kTileNumbers);
    const double part[5] = {double(b.probes), double(b.half_rank), double(b.byte_rank), column * b.half_rank,
                            column * b.byte_rank};
    for (int k = 0; k < 5; ++k)
      sizes[k] += part[k];
  }
  const auto rows = static_cast<double>(sources) * kTileNumbers;
  const auto differ = [](double expected, std::size_t size) { return expected != static_cast<double>(size); };
  if (differ(sizes[0], basis.probe.size()) || differ(sizes[1], basis.half_scale.size()) ||
      differ(sizes[2], basis.byte_scale.size()) || differ(sizes[3], basis.probe_half.size()) ||
      differ(sizes[4], basis.probe_byte.size()) ||
      differ(rows * static_cast<double>(tiles_of(basis.half_scale.size())), basis.source_half.size()) ||
      differ(rows * static_cast<double>(tiles_of(basis.byte_scale.size())), basis.source_byte.size()))
    return broken("the factors do not match the bricks");
  const auto finite = [](float x) { return std::isfinite(x); };
  const auto finite_half = [](std::uint16_t h) { return (h & 0x7c00u) != 0x7c00u; };
  if (!std::ranges::all_of(basis.half_scale, finite) || !std::ranges::all_of(basis.byte_scale, finite) ||
      !std::ranges::all_of(basis.source_half, finite_half) || !std::ranges::all_of(basis.probe_half, finite_half))
    return broken("a factor is not finite");
  return {};
}

} // namespace

Result<void> check_compact(const CompactBasis& basis, int regions, std::size_t probes) {
  if (const Result<void> good = check_first_light(basis.light, basis.sources, regions); !good)
    return good;
  if (const Result<void> good = check_factors(basis.nine, basis.sources, probes); !good)
    return good;
  return check_factors(basis.band4, basis.sources, probes);
}

} // namespace daylit
