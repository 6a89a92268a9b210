#pragma once

// The inner loops of a compact basis (scene/compact_basis.h): bytes as they lie in the file times weights rounded to 16
// bits, summed exactly as integers. One stream through memory, sums in registers. Four bytes beside each other belong
// to four rows and one column, which is what the processor's instruction multiplies at once.

#include <cstddef>
#include <cstdint>
#include <span>

#include "scene/volume/plane_weights.h"

namespace daylit::detail {

constexpr std::size_t kMostQuads = 16384; ///< in one call: their integer sums are exact in 32 bits

struct PlaneKernels {
  const char* name; ///< "baseline", "avx2", "avx512vnni"
  /// sum[colour * planes + plane] += sum over k of weight[k] . factor[quad[k]][plane]; `factor` is [quad][planes][4],
  /// `planes` a multiple of 4.
  void (*sum_planes)(const std::int8_t* factor, std::size_t planes, std::span<const std::uint32_t> quad,
                     const ColourWeights* weight, float* sum);
  /// sum[number] += sum over q of weight[q] . tile[q][number]; `tile` is [quad][numbers][4], `numbers` a multiple of
  /// 16, at most 128.
  void (*sum_numbers)(const std::int8_t* tile, std::size_t numbers, std::span<const QuadWeights> weight, float* sum);
  RoundQuads round_quads;
};

/// The widest that this processor runs.
const PlaneKernels& plane_kernels();
/// All that this processor runs, narrowest first.
std::span<const PlaneKernels> usable_plane_kernels();

} // namespace daylit::detail
