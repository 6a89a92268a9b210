#pragma once

// The inner loops of combining a volume: weighted sums of rows over tiles of 128 numbers. One stream through memory,
// eight vector accumulators, no write until the tile is done. Compiled per vector width, chosen when the program
// starts; every version performs the same operations in the same order per number, so all but the fused
// multiply-add of the wide versions agree bit for bit.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

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
using AddRows = void (*)(const float* tile, std::span<const WeightedRow> rows, std::size_t first, std::size_t count,
                         float* sum);

/// Fixed point: rows lie in pairs, [pair][128][2], and a number is row_scale[row] * tile_scale * integer with at most
/// kFixedMost.
constexpr std::int32_t kFixedMost = 8191;
constexpr std::size_t kFixedChunk = 16;
static_assert(2 * std::int64_t{kFixedChunk} * kFixedMost * kFixedMost < 0x7fffffff);

/// Rows for tiles of fixed point, prepared once for all tiles: weights times row scales, rounded to the same range for
/// each kFixedChunk pairs in turn. Their integer sums are exact in 32 bits.
struct FixedRows {
  FixedRows() = default;
  /// `weight` and `row_scale`: of all rows; `pairs`: those that count; `far`: the tiles are not in a fast cache.
  FixedRows(std::span<const float> weight, std::span<const float> row_scale, std::vector<std::uint32_t> pairs,
            bool far = false);

  std::vector<std::uint32_t> pair;
  std::vector<std::int32_t> weight; ///< two integers of 16 bits for each pair, the even row in the low half
  std::vector<float> step;          ///< of an integer product; of each chunk
  bool far = false;                 ///< whole chunks are fetched ahead
};

/// sum[k] += tile_scale * weight[row] * row_scale[row] * tile[row][k]. Integers are the same in every version.
using AddFixed = void (*)(const std::int16_t* tile, float tile_scale, const FixedRows& rows, std::size_t first,
                          std::size_t count, float* sum);

struct TileKernels {
  const char* name; ///< "baseline", "avx2", "avx512", "avx512vnni"
  AddRows add_float;
  AddFixed add_fixed;
  /// sum[c] = sum over b and k < 8 of weight[8 b + k] * radiance[block[b]][c][k]; weights are half floats.
  void (*dot_half_blocks)(const std::uint16_t* weight, std::span<const std::uint16_t> block, const float* radiance,
                          float sum[3]);
  /// rgb[3 k + c] = plane_c[k], or += for add_interleaved
  void (*interleave)(const float* r, const float* g, const float* b, std::size_t count, float* rgb);
  void (*add_interleaved)(const float* r, const float* g, const float* b, std::size_t count, float* rgb);
  float (*sum_bytes)(const std::byte* data, std::size_t size); ///< a plain read: the yardstick of the benchmark
};

/// The widest that this processor runs.
const TileKernels& tile_kernels();
/// All that this processor runs, narrowest first.
std::span<const TileKernels> usable_tile_kernels();

} // namespace daylit::detail
