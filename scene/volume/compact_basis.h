#pragma once

// A basis for thousands of sky directions in a small file, in two steps. The sky lights the surfaces: the irradiance of
// each piece of surface (a source) is a sparse sum over the sky's nodes, kept at full angular resolution. The surfaces
// light the probes: in each brick of neighbouring probes the transport from all sources is a product of two factors,
//   irradiance[source] = sum_node light[source, node] * radiance[node]
//   field[probe, lm, channel] = sum_k probe_factor[k][probe, lm, channel] * scale[k] *
//                               sum_piece source_factor[k][piece] * irradiance[piece],
// whose rank follows from the error. A piece is what the brick tells apart: one source, or a group of neighbouring ones
// with one sum. Components that carry most of the light are words of two bytes, the others bytes.

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "scene/core/result.h"
#include "scene/image/rgb_image.h"
#include "scene/volume/first_light.h"

namespace daylit {

/// Real orthonormal SH coefficients of radiance, index l*l+l+m, l <= 2.
using Sh9Rgb = std::array<Rgb, 9>;
/// Those of l = 4, index m + 4: what irradiance takes next, because its kernel has no band 3 (sh/band4.h).
using Band4Rgb = std::array<Rgb, 9>;

/// From the sources to nine numbers per probe. Factors in the order in which they are read: four rows beside each other
/// (detail/plane_kernels.h), padded with zeros. Bytes of a component are a plane; words, 256 high + low, have two. A
/// brick's planes: the high bytes of its words, their low bytes, its bytes.
struct CompactFactors {
  struct Brick {
    std::uint32_t probes = 0, pieces = 0, word_rank = 0, byte_rank = 0;

    std::size_t rank() const { return std::size_t{word_rank} + byte_rank; }
    std::size_t planes() const { return 2 * std::size_t{word_rank} + byte_rank; }
    std::size_t numbers() const { return std::size_t{probes} * 9; } ///< of one colour
    std::size_t padded_numbers() const { return (numbers() + 15) / 16 * 16; }
    std::size_t piece_quads() const { return (std::size_t{pieces} + 3) / 4; }
    std::size_t plane_quads() const { return (planes() + 3) / 4; }
    std::size_t source_bytes() const { return piece_quads() * plane_quads() * 16; }
    std::size_t probe_bytes() const { return 3 * padded_numbers() * plane_quads() * 4; }
    /// Where the number of a plane is among the brick's bytes.
    std::size_t source_at(std::size_t plane, std::size_t piece) const {
      return (piece / 4 * plane_quads() * 4 + plane) * 4 + piece % 4;
    }
    /// `number`: probe * 9 + lm, within the brick. A tile has 128 numbers, the last what is left.
    std::size_t probe_at(std::size_t plane, std::size_t channel, std::size_t number) const {
      const std::size_t tile = number / 128 * 128, width = std::min<std::size_t>(128, padded_numbers() - tile),
                        begin = (channel * padded_numbers() + tile) * plane_quads();
      return (begin + plane / 4 * width + number % 128) * 4 + plane % 4;
    }
  };
  std::vector<Brick> brick;
  std::vector<std::uint32_t> probe;       ///< numbers of the probes, brick by brick, each at most once
  std::vector<std::uint32_t> piece;       ///< brick by brick: number of a source, or sources + that of a group
  std::vector<float> scale;               ///< of each component, brick by brick, words first
  std::vector<std::int8_t> source_factor; ///< brick by brick: [quad of pieces][plane, in whole quads][4]
  std::vector<std::int8_t> probe_factor;  ///< brick by brick: [channel][tile][quad of planes][number][4]

  std::size_t bytes() const;
};

struct CompactBasis {
  /// Sources [first, end) as one; groups follow each other.
  struct Group {
    std::uint32_t first = 0, end = 0;
  };
  std::uint32_t sources = 0;
  FirstLight light; ///< on each source
  std::vector<Group> group;
  std::vector<float> group_weight; ///< of each source in the sum of its group
  CompactFactors nine;             ///< coefficients of l <= 2
  CompactFactors band4;            ///< of l = 4, of the probes where they change irradiance; no bricks: not known

  std::size_t bytes() const;
};

/// Where the parts of a brick begin.
struct BrickPlace {
  std::size_t probe = 0, piece = 0, component = 0, source_byte = 0, probe_byte = 0;
};
std::vector<BrickPlace> brick_places(const CompactFactors& factors); ///< of each brick, and the end

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
