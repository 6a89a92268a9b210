#include "scene/detail/integer_kernels.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "scene/detail/wide_vectors.h"

#define DAYLIT_INLINE inline __attribute__((always_inline))

namespace daylit::detail {

namespace {

constexpr std::size_t kPairNumbers = 2 * kTileNumbers;

/// Ahead of the stream: hardware prefetch stops at every page.
constexpr std::size_t kPairsAhead = 4, kBytesAhead = 2048;

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
      total[b] = _mm512_dpwssd_epi32(total[b], weight, _mm512_loadu_si512(row + 32 * b));
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

// Sums of the two bytes of the weights: 64 numbers of four rows at a time, each lane of 32 bits holding one number of
// the four rows. Data are offset by 128, because one operand of the instruction is unsigned.

/// Four rows of 64 bytes to four registers with the four numbers of a column side by side.
DAYLIT_VNNI DAYLIT_INLINE void columns_of(const std::int8_t* const row[ByteRows::kQuad], std::size_t at,
                                          __m512i out[4]) {
  const __m512i a = _mm512_loadu_si512(row[0] + at), b = _mm512_loadu_si512(row[1] + at),
                c = _mm512_loadu_si512(row[2] + at), d = _mm512_loadu_si512(row[3] + at);
  const __m512i flip = _mm512_set1_epi8(-128);
  const __m512i ab_low = _mm512_unpacklo_epi8(a, b), ab_high = _mm512_unpackhi_epi8(a, b),
                cd_low = _mm512_unpacklo_epi8(c, d), cd_high = _mm512_unpackhi_epi8(c, d);
  out[0] = _mm512_xor_si512(flip, _mm512_unpacklo_epi16(ab_low, cd_low));
  out[1] = _mm512_xor_si512(flip, _mm512_unpackhi_epi16(ab_low, cd_low));
  out[2] = _mm512_xor_si512(flip, _mm512_unpacklo_epi16(ab_high, cd_high));
  out[3] = _mm512_xor_si512(flip, _mm512_unpackhi_epi16(ab_high, cd_high));
}

/// Adds the sums to 64 numbers in their order: register r, lane of four numbers l hold numbers 16 l + 4 r and on.
DAYLIT_VNNI DAYLIT_INLINE void add_sums(const __m512i high[4], const __m512i low[4], float step, float* sum) {
  __m512 f[4];
#pragma GCC unroll 4
  for (int r = 0; r < 4; ++r)
    f[r] = _mm512_fmadd_ps(_mm512_set1_ps(128.0f), _mm512_cvtepi32_ps(high[r]), _mm512_cvtepi32_ps(low[r]));
  const __m512 p = _mm512_shuffle_f32x4(f[0], f[1], 0x44), q = _mm512_shuffle_f32x4(f[0], f[1], 0xee),
               s = _mm512_shuffle_f32x4(f[2], f[3], 0x44), t = _mm512_shuffle_f32x4(f[2], f[3], 0xee);
  const __m512 in_order[4] = {_mm512_shuffle_f32x4(p, s, 0x88), _mm512_shuffle_f32x4(p, s, 0xdd),
                              _mm512_shuffle_f32x4(q, t, 0x88), _mm512_shuffle_f32x4(q, t, 0xdd)};
  const __m512 scale = _mm512_set1_ps(step);
#pragma GCC unroll 4
  for (int l = 0; l < 4; ++l)
    _mm512_storeu_ps(sum + 16 * l, _mm512_fmadd_ps(scale, in_order[l], _mm512_loadu_ps(sum + 16 * l)));
}

/// 64 numbers from `at` on, all rows.
template <std::size_t kColours>
DAYLIT_VNNI DAYLIT_INLINE void add_64(const std::int8_t* tile, const ByteRows& rows, std::size_t at,
                                      float* const* sum) {
  __m512i high[kColours][4], low[kColours][4];
#pragma GCC unroll 3
  for (std::size_t c = 0; c < kColours; ++c)
#pragma GCC unroll 4
    for (int r = 0; r < 4; ++r) {
      high[c][r] = _mm512_set1_epi32(static_cast<std::int32_t>(-128 * rows.colour[c].high_total));
      low[c][r] = _mm512_set1_epi32(static_cast<std::int32_t>(-128 * rows.colour[c].low_total));
    }
  const std::size_t quads = rows.row.size() / ByteRows::kQuad;
  for (std::size_t q = 0; q < quads; ++q) {
    const std::int8_t* row[ByteRows::kQuad];
#pragma GCC unroll 4
    for (std::size_t i = 0; i < ByteRows::kQuad; ++i) {
      row[i] = tile + rows.row[ByteRows::kQuad * q + i] * kTileNumbers;
      _mm_prefetch(reinterpret_cast<const char*>(row[i] + at + kBytesAhead), _MM_HINT_T0);
    }
    __m512i column[4];
    columns_of(row, at, column);
#pragma GCC unroll 3
    for (std::size_t c = 0; c < kColours; ++c) {
      const __m512i h = _mm512_set1_epi32(rows.colour[c].high[q]), l = _mm512_set1_epi32(rows.colour[c].low[q]);
#pragma GCC unroll 4
      for (int r = 0; r < 4; ++r) {
        high[c][r] = _mm512_dpbusd_epi32(high[c][r], column[r], h);
        low[c][r] = _mm512_dpbusd_epi32(low[c][r], column[r], l);
      }
    }
  }
#pragma GCC unroll 3
  for (std::size_t c = 0; c < kColours; ++c)
    add_sums(high[c], low[c], rows.colour[c].step, sum[c] + at);
}

ByteRows::Colour round_bytes(std::span<const float> weight) {
  float most = 0;
  for (const float w : weight)
    most = std::max(most, std::abs(w));
  ByteRows::Colour out;
  const std::size_t words = (weight.size() + ByteRows::kQuad - 1) / ByteRows::kQuad;
  out.high.assign(words, 0);
  out.low.assign(words, 0);
  out.step = most / ByteRows::kMost;
  if (!(out.step > 0))
    return out.step = 0, out;
  for (std::size_t i = 0; i < weight.size(); ++i) {
    const auto rounded = static_cast<std::int32_t>(std::lrint(weight[i] / most * ByteRows::kMost));
    const std::int32_t high = (rounded + 64) >> 7, low = rounded - 128 * high; // |high| <= 127, -64 <= low <= 63
    const std::size_t shift = 8 * (i % ByteRows::kQuad);
    out.high[i / ByteRows::kQuad] |= static_cast<std::int32_t>((static_cast<std::uint32_t>(high) & 0xffu) << shift);
    out.low[i / ByteRows::kQuad] |= static_cast<std::int32_t>((static_cast<std::uint32_t>(low) & 0xffu) << shift);
    out.high_total += high;
    out.low_total += low;
  }
  return out;
}

/// Fills up the last word.
template <class Row>
std::vector<std::uint32_t> row_numbers(std::span<const Row> rows) {
  std::vector<std::uint32_t> out;
  out.reserve(rows.size() + ByteRows::kQuad);
  for (const Row& r : rows)
    out.push_back(r.row);
  while (out.size() % ByteRows::kQuad != 0)
    out.push_back(out.back());
  return out;
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

DAYLIT_VNNI void add_bytes_vnni(const std::int8_t* tile, const ByteRows& rows, float* const* sum) {
  for (std::size_t at = 0; at < kTileNumbers; at += 64)
    rows.colour.size() == 1 ? add_64<1>(tile, rows, at, sum) : add_64<3>(tile, rows, at, sum);
}

ByteRows::ByteRows(std::span<const WeightedRow> rows) : row(row_numbers(rows)), plain(rows) {
  std::vector<float> weight(rows.size());
  std::ranges::transform(rows, weight.begin(), &WeightedRow::weight);
  colour.push_back(round_bytes(weight));
}

ByteRows::ByteRows(std::span<const ColouredRow> rows) : row(row_numbers(rows)), coloured(rows) {
  std::vector<float> weight(rows.size());
  for (std::size_t c = 0; c < 3; ++c) {
    std::ranges::transform(rows, weight.begin(), [&](const ColouredRow& r) { return r.weight[c]; });
    colour.push_back(round_bytes(weight));
  }
}

} // namespace daylit::detail
