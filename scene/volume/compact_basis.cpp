#include "scene/volume/compact_basis.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "scene/core/parallel.h"
#include "scene/volume/brick_sums.h"
#include "scene/volume/plane_kernels.h"

namespace daylit {

using detail::kMostQuads;
using detail::kQuad;

namespace {

/// Light on the sources, then on the groups, in 16 bits.
detail::RoundedColours light_on_pieces(const CompactBasis& basis, std::span<const Rgb> region_radiance) {
  std::vector<Rgb> light = received(basis.light, basis.sources, region_radiance);
  light.reserve(light.size() + basis.group.size());
  for (const CompactBasis::Group& group : basis.group) {
    Rgb sum(0.0f);
    for (std::size_t s = group.first; s < group.end; ++s)
      sum += basis.group_weight[s] * light[s];
    light.push_back(sum);
  }
  return detail::RoundedColours(light);
}

/// Amplitude of each component: [colour][component].
std::vector<float> amplitudes(const CompactFactors& factors, const BrickPlace& at, const CompactFactors::Brick& brick,
                              const detail::RoundedColours& light) {
  const detail::LitQuads lit = light.lit_quads(std::span(factors.piece).subspan(at.piece, brick.pieces));
  const std::size_t planes = brick.plane_quads() * kQuad, rank = brick.rank();
  std::vector<float> sum(3 * planes, 0.0f), amplitude(3 * rank);
  for (std::size_t first = 0; first < lit.quad.size(); first += kMostQuads) {
    const std::size_t count = std::min(kMostQuads, lit.quad.size() - first);
    detail::plane_kernels().sum_planes(factors.source_factor.data() + at.source_byte, planes,
                                       std::span(lit.quad).subspan(first, count), lit.weight.data() + first,
                                       sum.data());
  }
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t k = 0; k < rank; ++k) {
      const float* low = sum.data() + c * planes + brick.word_rank + k; // of a byte: the byte
      const float whole = k < brick.word_rank ? 256.0f * sum[c * planes + k] + *low : *low;
      amplitude[c * rank + k] = light.step[c] * factors.scale[at.component + k] * whole;
    }
  return amplitude;
}

void combine_brick(const CompactFactors& factors, const BrickPlace& at, const CompactFactors::Brick& brick,
                   const detail::RoundedColours& light, std::span<std::array<Rgb, 9>> result) {
  std::vector<std::array<Rgb, 9>> of_brick(brick.probes);
  detail::sum_brick(brick, factors.probe_factor.data() + at.probe_byte, amplitudes(factors, at, brick, light),
                    of_brick);
  for (std::size_t p = 0; p < brick.probes; ++p)
    result[factors.probe[at.probe + p]] = of_brick[p];
}

void combine_bricks(const CompactFactors& factors, const detail::RoundedColours& light,
                    const std::vector<std::uint8_t>& bricks, std::span<std::array<Rgb, 9>> result) {
  const std::vector<BrickPlace> at = brick_places(factors);
  parallel_for(std::size_t{0}, bricks.size(), [&](std::size_t b) {
    if (bricks[b] != 0)
      combine_brick(factors, at[b], factors.brick[b], light, result);
  });
}

Error broken(const char* what) {
  return {ErrorCode::file_malformed, what, "compact basis", "bake it again with daylit-precompute"};
}

} // namespace

std::size_t CompactFactors::bytes() const {
  return source_factor.size() + probe_factor.size() +
         4 * (probe.size() + piece.size() + 4 * brick.size() + scale.size());
}

std::size_t CompactBasis::bytes() const {
  return light.bytes() + 8 * group.size() + 4 * group_weight.size() + nine.bytes() + band4.bytes();
}

std::vector<BrickPlace> brick_places(const CompactFactors& factors) {
  std::vector<BrickPlace> list(factors.brick.size() + 1);
  for (std::size_t b = 0; b < factors.brick.size(); ++b) {
    const CompactFactors::Brick& brick = factors.brick[b];
    list[b + 1] = {list[b].probe + brick.probes, list[b].piece + brick.pieces, list[b].component + brick.rank(),
                   list[b].source_byte + brick.source_bytes(), list[b].probe_byte + brick.probe_bytes()};
  }
  return list;
}

void combine(const CompactBasis& basis, std::span<const Rgb> region_radiance, std::span<Sh9Rgb> result,
             std::span<Band4Rgb> band4) {
  const detail::RoundedColours light = light_on_pieces(basis, region_radiance);
  const auto all = [&](const CompactFactors& factors, std::span<std::array<Rgb, 9>> numbers) {
    combine_bricks(factors, light, std::vector<std::uint8_t>(factors.brick.size(), 1), numbers);
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
  combine_bricks(nine, light_on_pieces(basis, region_radiance), bricks, result);
}

namespace {

Result<void> check_factors(const CompactBasis& basis, const CompactFactors& factors, std::size_t probes) {
  std::vector<std::uint8_t> seen(probes, 0);
  for (const std::uint32_t p : factors.probe) {
    if (p >= probes || seen[p] != 0)
      return broken("a brick names a probe that does not exist, or one twice");
    seen[p] = 1;
  }
  // Sums of products of 32-bit numbers: double is exact enough to refuse what does not fit, and does not overflow.
  double sizes[5] = {};
  for (const CompactFactors::Brick& b : factors.brick) {
    const double part[5] = {double(b.probes), double(b.pieces), double(b.rank()),
                            16.0 * double(b.piece_quads()) * double(b.plane_quads()),
                            12.0 * double(b.padded_numbers()) * double(b.plane_quads())};
    for (int k = 0; k < 5; ++k)
      sizes[k] += part[k];
  }
  const std::size_t given[5] = {factors.probe.size(), factors.piece.size(), factors.scale.size(),
                                factors.source_factor.size(), factors.probe_factor.size()};
  for (int k = 0; k < 5; ++k)
    if (sizes[k] != static_cast<double>(given[k]))
      return broken("the factors do not match the bricks");
  const std::size_t pieces = std::size_t{basis.sources} + basis.group.size();
  if (std::ranges::any_of(factors.piece, [&](std::uint32_t p) { return p >= pieces; }))
    return broken("a brick names a piece of surface that does not exist");
  if (!std::ranges::all_of(factors.scale, [](float x) { return std::isfinite(x); }))
    return broken("a factor is not finite");
  return {};
}

Result<void> check_groups(const CompactBasis& basis) {
  std::uint32_t end = 0;
  for (const CompactBasis::Group& g : basis.group) {
    if (g.first < end || g.end < g.first || g.end > basis.sources)
      return broken("groups of sources overlap or leave the sources");
    end = g.end;
  }
  if (basis.group_weight.size() != basis.sources ||
      !std::ranges::all_of(basis.group_weight, [](float x) { return std::isfinite(x); }))
    return broken("the weights in the groups are not finite, or not those of the sources");
  return {};
}

} // namespace

Result<void> check_compact(const CompactBasis& basis, int regions, std::size_t probes) {
  if (const Result<void> good = check_first_light(basis.light, basis.sources, regions); !good)
    return good;
  if (const Result<void> good = check_groups(basis); !good)
    return good;
  if (const Result<void> good = check_factors(basis, basis.nine, probes); !good)
    return good;
  return check_factors(basis, basis.band4, probes);
}

} // namespace daylit
