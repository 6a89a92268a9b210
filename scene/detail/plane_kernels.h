#pragma once

// The inner loops of a compact basis (scene/compact_basis.h): bytes as they lie in the file times weights rounded to 16
// bits, summed exactly as integers. One stream through memory, sums in registers. Four bytes beside each other belong
// to four rows and one column, which is what the processor's instruction multiplies at once.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace daylit::detail {

constexpr std::size_t kQuad = 4;          ///< rows side by side
constexpr std::size_t kMostQuads = 16384; ///< in one call: their integer sums are exact in 32 bits
constexpr std::int32_t kWeightMost = 127 * 256 + 127;

/// Four weights in two limbs: weight = 256 high + low, a signed byte of each word for each.
struct QuadWeights {
  std::int32_t high, low;
};

/// The same for three colours.
struct alignas(32) ColourWeights {
  std::int32_t high[3], low[3], unused[2];
};

/// Weights of one colour, whole quads. `step` is 0 for weights that are all 0.
struct RoundedWeights {
  explicit RoundedWeights(std::span<const float> weight);

  std::vector<QuadWeights> quad;
  float step = 0;
};

/// Weights of three colours, each rounded in steps of its largest: [k] has the six bytes of weight k in the order of
/// ColourWeights, so that four of them are transposed to one.
struct RoundedColours {
  explicit RoundedColours(std::span<const std::array<float, 3>> weight);

  /// Of weights at[0] to at[3].
  ColourWeights quad(const std::uint32_t* at) const;

  std::vector<std::uint64_t> entry;
  std::array<float, 3> step{};
};

struct PlaneKernels {
  const char* name; ///< "baseline", "avx2", "avx512vnni"
  /// sum[colour * planes + plane] += sum over k of weight[k] . factor[quad[k]][plane]; `factor` is [quad][planes][4],
  /// `planes` a multiple of 4.
  void (*sum_planes)(const std::int8_t* factor, std::size_t planes, std::span<const std::uint32_t> quad,
                     const ColourWeights* weight, float* sum);
  /// sum[number] += sum over q of weight[q] . tile[q][number]; `tile` is [quad][numbers][4], `numbers` a multiple of
  /// 16, at most 128.
  void (*sum_numbers)(const std::int8_t* tile, std::size_t numbers, std::span<const QuadWeights> weight, float* sum);
};

/// The widest that this processor runs.
const PlaneKernels& plane_kernels();
/// All that this processor runs, narrowest first.
std::span<const PlaneKernels> usable_plane_kernels();

} // namespace daylit::detail
