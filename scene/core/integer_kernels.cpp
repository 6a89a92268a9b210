#include "scene/core/integer_kernels.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "scene/core/wide_vectors.h"

namespace daylit::detail {

namespace {

constexpr std::size_t kPairNumbers = 2 * kTileNumbers;

/// Ahead of the stream: hardware prefetch stops at every page.
constexpr std::size_t kPairsAhead = 4;

/// Pairs [begin, end) of a chunk.
struct Chunk {
  std::size_t begin, end;
  bool is_whole() const { return end - begin == kFixedChunk; }
};
DAYLIT_INLINE Chunk chunk_of(const FixedRows& rows, std::size_t i) {
  return {i * kFixedChunk, std::min((i + 1) * kFixedChunk, rows.pair.size())};
}

/// kBlocks blocks of 16 numbers: sum[k] += tile_scale * step * (integer sum), chunk after chunk.
template <int kBlocks>
DAYLIT_AVX2 void add_blocks_avx2(const std::int16_t* tile, float tile_scale, const FixedRows& rows, float* sum) {
  for (std::size_t i = 0; i < rows.step.size(); ++i) {
    __m256i total[2 * kBlocks];
#pragma GCC unroll 8
    for (__m256i& t : total)
      t = _mm256_setzero_si256();
    const Chunk chunk = chunk_of(rows, i);
    for (std::size_t p = chunk.begin; p < chunk.end; ++p) {
      const __m256i weight = _mm256_set1_epi32(rows.weight[p]);
      const std::int16_t* row = tile + rows.pair[p] * kPairNumbers;
#pragma GCC unroll 8
      for (int b = 0; b < 2 * kBlocks; ++b)
        total[b] = _mm256_add_epi32(
            total[b], _mm256_madd_epi16(weight, _mm256_loadu_si256(reinterpret_cast<const __m256i*>(row + 16 * b))));
    }
    const __m256 step = _mm256_set1_ps(tile_scale * rows.step[i]);
#pragma GCC unroll 8
    for (int b = 0; b < 2 * kBlocks; ++b)
      _mm256_storeu_ps(sum + 8 * b, _mm256_fmadd_ps(step, _mm256_cvtepi32_ps(total[b]), _mm256_loadu_ps(sum + 8 * b)));
  }
}

template <int kBlocks>
DAYLIT_AVX512 void add_blocks_avx512(const std::int16_t* tile, float tile_scale, const FixedRows& rows, float* sum) {
  for (std::size_t i = 0; i < rows.step.size(); ++i) {
    __m512i total[kBlocks];
#pragma GCC unroll 8
    for (__m512i& t : total)
      t = _mm512_setzero_si512();
    const Chunk chunk = chunk_of(rows, i);
    for (std::size_t p = chunk.begin; p < chunk.end; ++p) {
      const __m512i weight = _mm512_set1_epi32(rows.weight[p]);
      const std::int16_t* row = tile + rows.pair[p] * kPairNumbers;
#pragma GCC unroll 8
      for (int b = 0; b < kBlocks; ++b)
        total[b] = _mm512_add_epi32(total[b], _mm512_madd_epi16(weight, _mm512_loadu_si512(row + 32 * b)));
    }
    const __m512 step = _mm512_set1_ps(tile_scale * rows.step[i]);
#pragma GCC unroll 8
    for (int b = 0; b < kBlocks; ++b)
      _mm512_storeu_ps(sum + 16 * b,
                       _mm512_fmadd_ps(step, _mm512_cvtepi32_ps(total[b]), _mm512_loadu_ps(sum + 16 * b)));
  }
}

template <int kBlocks, bool kPrefetch>
DAYLIT_VNNI DAYLIT_INLINE void sum_chunk_vnni(const std::int16_t* tile, const FixedRows& rows, const Chunk& chunk,
                                              __m512i* total) {
#pragma GCC unroll 8
  for (int b = 0; b < kBlocks; ++b)
    total[b] = _mm512_setzero_si512();
  for (std::size_t p = chunk.begin; p < chunk.end; ++p) {
    const __m512i weight = _mm512_set1_epi32(rows.weight[p]);
    const std::int16_t* row = tile + rows.pair[p] * kPairNumbers;
#pragma GCC unroll 8
    for (int b = 0; b < kBlocks; ++b) {
      if constexpr (kPrefetch)
        _mm_prefetch(reinterpret_cast<const char*>(row + kPairsAhead * kPairNumbers + 32 * b), _MM_HINT_T0);
      add_word_products(total[b], _mm512_loadu_si512(row + 32 * b), weight);
    }
  }
}

/// The sums stay in registers. A few rows of a tile are not followed by others that are asked for.
template <int kBlocks>
DAYLIT_VNNI void add_blocks_vnni(const std::int16_t* tile, float tile_scale, const FixedRows& rows, float* sum) {
  __m512 s[kBlocks];
  __m512i total[kBlocks];
#pragma GCC unroll 8
  for (int b = 0; b < kBlocks; ++b)
    s[b] = _mm512_loadu_ps(sum + 16 * b);
  for (std::size_t i = 0; i < rows.step.size(); ++i) {
    const Chunk chunk = chunk_of(rows, i);
    if (rows.far && chunk.is_whole())
      sum_chunk_vnni<kBlocks, true>(tile, rows, chunk, total);
    else
      sum_chunk_vnni<kBlocks, false>(tile, rows, chunk, total);
    const __m512 step = _mm512_set1_ps(tile_scale * rows.step[i]);
#pragma GCC unroll 8
    for (int b = 0; b < kBlocks; ++b)
      s[b] = _mm512_fmadd_ps(step, _mm512_cvtepi32_ps(total[b]), s[b]);
  }
#pragma GCC unroll 8
  for (int b = 0; b < kBlocks; ++b)
    _mm512_storeu_ps(sum + 16 * b, s[b]);
}

} // namespace

FixedRows::FixedRows(std::span<const float> all_weights, std::span<const float> row_scale,
                     std::vector<std::uint32_t> pairs, bool is_far)
    : pair(std::move(pairs)), far(is_far) {
  weight.reserve(pair.size());
  for (std::size_t begin = 0; begin < pair.size(); begin += kFixedChunk) {
    std::array<float, 2 * kFixedChunk> product{};
    const std::size_t count = std::min(kFixedChunk, pair.size() - begin);
    float most = 0;
    for (std::size_t k = 0; k < 2 * count; ++k) {
      const std::size_t row = 2 * std::size_t{pair[begin + k / 2]} + k % 2;
      product[k] = all_weights[row] * row_scale[row];
      most = std::max(most, std::abs(product[k]));
    }
    step.push_back(most / kFixedMost);
    const float inverse = step.back() > 0 ? kFixedMost / most : 0.0f;
    for (std::size_t i = 0; i < count; ++i)
      weight.push_back(static_cast<std::int32_t>(std::lrint(product[2 * i] * inverse) & 0xffff) |
                       static_cast<std::int32_t>(std::lrint(product[2 * i + 1] * inverse)) * 0x10000);
  }
}

void add_fixed_baseline(const std::int16_t* tile, float tile_scale, const FixedRows& rows, std::size_t first,
                        std::size_t count, float* sum) {
  for (std::size_t i = 0; i < rows.step.size(); ++i)
    for (std::size_t k = first * kBlockNumbers; k < (first + count) * kBlockNumbers; ++k) {
      std::int32_t total = 0;
      const Chunk chunk = chunk_of(rows, i);
      for (std::size_t p = chunk.begin; p < chunk.end; ++p) {
        const std::int16_t* numbers = tile + rows.pair[p] * kPairNumbers + 2 * k;
        total += static_cast<std::int16_t>(rows.weight[p] & 0xffff) * numbers[0] + (rows.weight[p] >> 16) * numbers[1];
      }
      sum[k] += tile_scale * rows.step[i] * static_cast<float>(total);
    }
}

namespace {

using AddBlocks = void (*)(const std::int16_t* tile, float tile_scale, const FixedRows& rows, float* sum);

/// `several` takes `at_once` blocks, `one` the rest.
DAYLIT_INLINE void add_parts(const std::int16_t* tile, float tile_scale, const FixedRows& rows, std::size_t first,
                             std::size_t count, float* sum, AddBlocks several, std::size_t at_once, AddBlocks one) {
  std::size_t block = first;
  for (; block + at_once <= first + count; block += at_once)
    several(tile + 2 * block * kBlockNumbers, tile_scale, rows, sum + block * kBlockNumbers);
  for (; block < first + count; ++block)
    one(tile + 2 * block * kBlockNumbers, tile_scale, rows, sum + block * kBlockNumbers);
}

} // namespace

void add_fixed_avx2(const std::int16_t* tile, float tile_scale, const FixedRows& rows, std::size_t first,
                    std::size_t count, float* sum) {
  add_parts(tile, tile_scale, rows, first, count, sum, add_blocks_avx2<4>, 4, add_blocks_avx2<1>);
}

void add_fixed_avx512(const std::int16_t* tile, float tile_scale, const FixedRows& rows, std::size_t first,
                      std::size_t count, float* sum) {
  add_parts(tile, tile_scale, rows, first, count, sum, add_blocks_avx512<8>, 8, add_blocks_avx512<1>);
}

void add_fixed_vnni(const std::int16_t* tile, float tile_scale, const FixedRows& rows, std::size_t first,
                    std::size_t count, float* sum) {
  add_parts(tile, tile_scale, rows, first, count, sum, add_blocks_vnni<8>, 8, add_blocks_vnni<1>);
}

} // namespace daylit::detail
