#pragma once

// A basis for thousands of sky directions in a small file, in two steps. The sky lights the surfaces: the irradiance of
// each piece of surface (a source) is a sparse sum over the sky's nodes, kept at full angular resolution. The surfaces
// light the probes: in each brick of neighbouring probes the transport from all sources is a product of two factors,
//   irradiance[source] = sum_node light[source, node] * radiance[node]
//   field[probe, lm, channel] = sum_k probe_factor[k][probe, lm, channel] * scale[k] *
//                               sum_source source_factor[source][k] * irradiance[source],
// whose rank follows from the error. Components that carry most of the light are half floats, the others bytes.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "scene/first_light.h"
#include "scene/result.h"
#include "scene/rgb_image.h"

namespace daylit {

/// Real orthonormal SH coefficients of radiance, index l*l+l+m, l <= 2.
using Sh9Rgb = std::array<Rgb, 9>;
/// Those of l = 4, index m + 4: what irradiance takes next, because its kernel has no band 3 (sh/band4.h).
using Band4Rgb = std::array<Rgb, 9>;

/// From the sources to nine numbers per probe. Factors in the order in which they are read: tiles of 128 numbers
/// (detail/tile_kernels.h), padded with zeros.
struct CompactFactors {
  struct Brick {
    std::uint32_t probes = 0, half_rank = 0, byte_rank = 0;
    std::size_t tiles() const { return (std::size_t{probes} * 9 + 127) / 128; } ///< of one colour
  };
  std::vector<Brick> brick;
  std::vector<std::uint32_t> probe;          ///< numbers of the probes, brick by brick, each at most once
  std::vector<float> half_scale, byte_scale; ///< of each component, brick by brick
  std::vector<std::uint16_t> source_half;    ///< [tile][source][128], components of all bricks side by side
  std::vector<std::int8_t> source_byte;
  std::vector<std::uint16_t> probe_half; ///< brick by brick: [channel][tile][component][128], numbers probe * 9 + lm
  std::vector<std::int8_t> probe_byte;

  std::size_t bytes() const;
};

struct CompactBasis {
  std::uint32_t sources = 0;
  FirstLight light;     ///< on each source
  CompactFactors nine;  ///< coefficients of l <= 2
  CompactFactors band4; ///< of l = 4, of the probes where they change irradiance; no bricks: not known

  std::size_t bytes() const;
};

/// Coefficients at all probes, those of no brick zero; `result` has one entry per probe of the volume, and so has
/// `band4` unless it is empty: then that part is not read.
/// Sources in the dark are not read. Independent of the thread count.
void combine(const CompactBasis& basis, std::span<const Rgb> region_radiance, std::span<Sh9Rgb> result,
             std::span<Band4Rgb> band4 = {});

/// The same bits at the probes of the bricks that hold `wanted`; others are left alone. Reads only what these need.
void combine_at(const CompactBasis& basis, std::span<const Rgb> region_radiance, std::span<const std::uint32_t> wanted,
                std::span<Sh9Rgb> result);

/// Sizes agree, indices are in range, numbers are finite.
Result<void> check_compact(const CompactBasis& basis, int regions, std::size_t probes);

} // namespace daylit
