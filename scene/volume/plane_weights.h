#pragma once

// What bytes are multiplied with (detail/plane_kernels.h): weights rounded to 16 bits, four beside each other, in two
// limbs of a signed byte each: weight = 256 high + low.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "scene/image/rgb_image.h"

namespace daylit::detail {

constexpr std::size_t kQuad = 4; ///< weights, and rows of bytes, side by side
constexpr std::int32_t kWeightMost = 127 * 256 + 127;

/// A byte of each limb for each weight.
struct QuadWeights {
  std::int32_t high, low;
};

/// Four weights of three colours.
struct alignas(32) ColourWeights {
  QuadWeights colour[3];
  std::int32_t unused[2];
};

/// Weights of one colour, whole quads. `step` is 0 for weights that are all 0.
struct RoundedWeights {
  explicit RoundedWeights(std::span<const float> weight);

  std::vector<QuadWeights> quad;
  float step = 0;
};

/// Quads of weights that are not all 0, of a list of weights, and which of the list's quads they are.
struct LitQuads {
  std::vector<std::uint32_t> quad;
  std::vector<ColourWeights> weight;
};

/// Weights of three colours, each rounded in steps of its largest: [k] has the six bytes of weight k in the order of
/// ColourWeights, so that four of them are transposed to one.
struct RoundedColours {
  explicit RoundedColours(std::span<const Rgb> weight);

  /// `list`: numbers of weights. What fills up its last quad is any of them: what they are multiplied with is 0.
  LitQuads lit_quads(std::span<const std::uint32_t> list) const;

  std::vector<std::uint64_t> entry;
  std::array<float, 3> step{};
};

/// Consecutive colours, all in steps of the largest number among them; `quad` has room for whole sixteens of colours,
/// those beyond the end become 0. Returns the step, 0 where all are black. The same integers in every version.
using RoundQuads = float (*)(std::span<const Rgb> colour, ColourWeights* quad);
float round_quads_baseline(std::span<const Rgb> colour, ColourWeights* quad);
float round_quads_avx512(std::span<const Rgb> colour, ColourWeights* quad);

} // namespace daylit::detail
