#pragma once

// The inner loops of combining a volume: weighted sums of rows over tiles of 128 numbers. One stream through memory,
// eight vector accumulators, no write until the tile is done. Compiled per vector width, chosen when the program
// starts; every version performs the same operations in the same order per number, so all but the fused
// multiply-add of the wide versions agree bit for bit.

#include <cstddef>
#include <cstdint>
#include <span>

namespace daylit::detail {

constexpr std::size_t kTileNumbers = 128;
/// Granularity of partial tiles: `first` and `count` of the kernels are in blocks of this many numbers.
constexpr std::size_t kBlockNumbers = 16;
constexpr std::size_t kTileBlocks = kTileNumbers / kBlockNumbers;

/// One row that counts: its number within the tile and its factor.
struct WeightedRow {
  std::uint32_t row;
  float weight;
};

/// sum[k] += weight * tile[row][k] for the numbers of blocks [first, first + count). `tile` is [rows][128].
template <class Number>
using AddRows = void (*)(const Number* tile, std::span<const WeightedRow> rows, std::size_t first, std::size_t count,
                         float* sum);

/// A row with a factor per colour.
struct ColouredRow {
  std::uint32_t row;
  float weight[3];
};

/// sum[c][k] += weight[c] * tile[row][k] for whole tiles: each number is fetched once for the three colours.
template <class Number>
using AddColours = void (*)(const Number* tile, std::span<const ColouredRow> rows, float* const sum[3]);

struct TileKernels {
  const char* name; ///< "baseline", "avx2", "avx512"
  AddRows<float> add_float;
  AddRows<std::uint16_t> add_half; ///< IEEE 754 binary16
  AddRows<std::int8_t> add_byte;
  AddColours<std::uint16_t> add_half_colours;
  AddColours<std::int8_t> add_byte_colours;
  /// sum[c] += sum_k weight[k] * plane[c * stride + k], weights in half floats.
  void (*dot_half_planes)(const std::uint16_t* weight, const float* plane, std::size_t stride, std::size_t count,
                          float sum[3]);
  /// rgb[3 k + c] = plane_c[k]
  void (*interleave)(const float* r, const float* g, const float* b, std::size_t count, float* rgb);
  float (*sum_bytes)(const std::byte* data, std::size_t size); ///< a plain read: the yardstick of the benchmark
};

/// The widest that this processor runs.
const TileKernels& tile_kernels();
/// All that this processor runs, narrowest first.
std::span<const TileKernels> usable_tile_kernels();

/// binary32 to binary16, to nearest even; overflow to infinity. And back, exact.
std::uint16_t to_half(float value);
float from_half(std::uint16_t half);

} // namespace daylit::detail
