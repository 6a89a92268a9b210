#include "scene/core/tile_kernels.h"

#include <array>
#include <cstring>

#include "scene/core/half_float.h"
#include "scene/core/integer_kernels.h"
#include "scene/core/wide_vectors.h"

namespace daylit::detail {

namespace {

void add_baseline(const float* tile, std::span<const WeightedRow> rows, std::size_t first, std::size_t count,
                  float* sum) {
  float* out = sum + first * kBlockNumbers;
  for (const WeightedRow& r : rows) {
    const float* row = tile + r.row * kTileNumbers + first * kBlockNumbers;
    for (std::size_t k = 0; k < count * kBlockNumbers; ++k)
      out[k] += r.weight * row[k];
  }
}

void dot_baseline(const std::uint16_t* weight, std::span<const std::uint16_t> block, const float* radiance,
                  float sum[3]) {
  sum[0] = sum[1] = sum[2] = 0.0f;
  for (std::size_t b = 0; b < block.size(); ++b)
    for (std::size_t k = 0; k < 8; ++k)
      for (std::size_t c = 0; c < 3; ++c)
        sum[c] += from_half(weight[8 * b + k]) * radiance[24 * block[b] + 8 * c + k];
}

template <bool kAdd>
void interleave_baseline(const float* r, const float* g, const float* b, std::size_t count, float* rgb) {
  for (std::size_t k = 0; k < count; ++k) {
    rgb[3 * k] = r[k] + (kAdd ? rgb[3 * k] : 0.0f);
    rgb[3 * k + 1] = g[k] + (kAdd ? rgb[3 * k + 1] : 0.0f);
    rgb[3 * k + 2] = b[k] + (kAdd ? rgb[3 * k + 2] : 0.0f);
  }
}

template <std::size_t kCount>
float add_up(const std::array<float, kCount>& lanes) {
  float total = 0;
  for (const float x : lanes)
    total += x;
  return total;
}

float sum_baseline(const std::byte* data, std::size_t size) {
  std::array<float, 16> sum{};
  std::array<float, 16> part;
  for (std::size_t k = 0; k + sizeof(part) <= size; k += sizeof(part)) {
    std::memcpy(part.data(), data + k, sizeof(part));
    for (std::size_t i = 0; i < part.size(); ++i)
      sum[i] += part[i];
  }
  return add_up(sum);
}

/// Half a tile at a time: sixteen registers leave room for eight sums.
DAYLIT_AVX2 void add_avx2(const float* tile, std::span<const WeightedRow> rows, std::size_t first, std::size_t count,
                          float* sum) {
  std::size_t at = first * kBlockNumbers;
  const std::size_t end = at + count * kBlockNumbers;
  for (; at + 64 <= end; at += 64) {
    __m256 s[8];
    for (int i = 0; i < 8; ++i)
      s[i] = _mm256_loadu_ps(sum + at + 8 * i);
    for (const WeightedRow& r : rows) {
      const __m256 w = _mm256_set1_ps(r.weight);
      const float* row = tile + r.row * kTileNumbers + at;
#pragma GCC unroll 8
      for (int i = 0; i < 8; ++i)
        s[i] = _mm256_fmadd_ps(w, _mm256_loadu_ps(row + 8 * i), s[i]);
    }
    for (int i = 0; i < 8; ++i)
      _mm256_storeu_ps(sum + at + 8 * i, s[i]);
  }
  for (; at < end; at += 8) {
    __m256 s = _mm256_loadu_ps(sum + at);
    for (const WeightedRow& r : rows)
      s = _mm256_fmadd_ps(_mm256_set1_ps(r.weight), _mm256_loadu_ps(tile + r.row * kTileNumbers + at), s);
    _mm256_storeu_ps(sum + at, s);
  }
}

/// Rows ahead of the stream: hardware prefetch stops at every page, and a wide loop crosses one every few nanoseconds.
constexpr std::size_t kRowsAhead = 2048 / (kTileNumbers * sizeof(float));

/// A few rows of a tile are not worth it: the next ones asked for are in another tile.
bool dense(std::span<const WeightedRow> rows) {
  return rows.size() > 4 * kRowsAhead && rows.back().row - rows.front().row < 2 * rows.size();
}

template <int kBlocks, bool kPrefetch>
DAYLIT_AVX512 inline void add_blocks(const float* tile, std::span<const WeightedRow> rows, float* sum) {
  __m512 s[kBlocks];
#pragma GCC unroll 8
  for (int i = 0; i < kBlocks; ++i)
    s[i] = _mm512_loadu_ps(sum + 16 * i);
  for (const WeightedRow& r : rows) {
    const __m512 w = _mm512_set1_ps(r.weight);
    const float* row = tile + r.row * kTileNumbers;
    if constexpr (kPrefetch) {
      const char* ahead = reinterpret_cast<const char*>(row + kRowsAhead * kTileNumbers);
#pragma GCC unroll 8
      for (std::size_t line = 0; line < kBlocks * 16 * sizeof(float); line += 64)
        _mm_prefetch(ahead + line, _MM_HINT_T0);
    }
#pragma GCC unroll 8
    for (int i = 0; i < kBlocks; ++i)
      s[i] = _mm512_fmadd_ps(w, _mm512_loadu_ps(row + 16 * i), s[i]);
  }
#pragma GCC unroll 8
  for (int i = 0; i < kBlocks; ++i)
    _mm512_storeu_ps(sum + 16 * i, s[i]);
}

DAYLIT_AVX512 void add_avx512(const float* tile, std::span<const WeightedRow> rows, std::size_t first,
                              std::size_t count, float* sum) {
  if (count == kTileBlocks)
    return dense(rows) ? add_blocks<8, true>(tile, rows, sum) : add_blocks<8, false>(tile, rows, sum);
  std::size_t at = first;
  const std::size_t end = first + count;
  for (; at + 4 <= end; at += 4)
    add_blocks<4, true>(tile + at * kBlockNumbers, rows, sum + at * kBlockNumbers);
  for (; at + 2 <= end; at += 2)
    add_blocks<2, true>(tile + at * kBlockNumbers, rows, sum + at * kBlockNumbers);
  if (at < end)
    add_blocks<1, true>(tile + at * kBlockNumbers, rows, sum + at * kBlockNumbers);
}

/// Where each of 48 interleaved numbers comes from: first among r and g, then b is put in between.
struct Interleave16 {
  alignas(64) std::array<std::array<std::int32_t, 16>, 3> red_green, blue;
};
constexpr Interleave16 interleave_tables() {
  Interleave16 t{};
  for (int v = 0; v < 3; ++v)
    for (int i = 0; i < 16; ++i) {
      const int k = 16 * v + i, channel = k % 3, source = k / 3;
      t.red_green[v][i] = channel == 1 ? 16 + source : source;
      t.blue[v][i] = channel == 2 ? 16 + source : i;
    }
  return t;
}
constexpr Interleave16 kInterleave = interleave_tables();

DAYLIT_AVX2 float add_lanes(__m256 x) {
  const __m128 four = _mm_add_ps(_mm256_castps256_ps128(x), _mm256_extractf128_ps(x, 1));
  const __m128 two = _mm_add_ps(four, _mm_movehl_ps(four, four));
  return _mm_cvtss_f32(_mm_add_ss(two, _mm_movehdup_ps(two)));
}

DAYLIT_AVX2 void dot_avx2(const std::uint16_t* weight, std::span<const std::uint16_t> block, const float* radiance,
                          float sum[3]) {
  __m256 s[2][3];
#pragma GCC unroll 6
  for (std::size_t i = 0; i < 6; ++i)
    s[i / 3][i % 3] = _mm256_setzero_ps();
  const auto add = [&](std::size_t b, __m256 total[3]) DAYLIT_AVX2 {
    const __m256 w = _mm256_cvtph_ps(_mm_loadu_si128(reinterpret_cast<const __m128i*>(weight + 8 * b)));
    const float* from = radiance + std::size_t{24} * block[b];
#pragma GCC unroll 3
    for (std::size_t c = 0; c < 3; ++c)
      total[c] = _mm256_fmadd_ps(w, _mm256_loadu_ps(from + 8 * c), total[c]);
  };
  std::size_t b = 0;
  for (; b + 2 <= block.size(); b += 2) { // independent sums hide the latency of each other
    add(b, s[0]);
    add(b + 1, s[1]);
  }
  if (b < block.size())
    add(b, s[0]);
#pragma GCC unroll 3
  for (std::size_t c = 0; c < 3; ++c)
    sum[c] = add_lanes(_mm256_add_ps(s[0][c], s[1][c]));
}

template <bool kAdd>
DAYLIT_AVX512 void interleave_avx512(const float* r, const float* g, const float* b, std::size_t count, float* rgb) {
  std::size_t k = 0;
  for (; k + 16 <= count; k += 16) {
    const __m512 red = _mm512_loadu_ps(r + k), green = _mm512_loadu_ps(g + k), blue = _mm512_loadu_ps(b + k);
    for (int v = 0; v < 3; ++v) {
      const __m512 rg = _mm512_permutex2var_ps(red, _mm512_load_si512(kInterleave.red_green[v].data()), green);
      const __m512 all = _mm512_permutex2var_ps(rg, _mm512_load_si512(kInterleave.blue[v].data()), blue);
      float* const to = rgb + 3 * k + 16 * v;
      _mm512_storeu_ps(to, kAdd ? _mm512_add_ps(_mm512_loadu_ps(to), all) : all);
    }
  }
  interleave_baseline<kAdd>(r + k, g + k, b + k, count - k, rgb + 3 * k);
}

DAYLIT_AVX512 float sum_avx512(const std::byte* data, std::size_t size) {
  __m512 s[8];
  for (__m512& x : s)
    x = _mm512_setzero_ps();
  for (std::size_t k = 0; k + 512 <= size; k += 512)
#pragma GCC unroll 8
    for (int i = 0; i < 8; ++i)
      s[i] = _mm512_add_ps(s[i], _mm512_loadu_ps(data + k + 64 * i));
  __m512 total = s[0];
  for (int i = 1; i < 8; ++i)
    total = _mm512_add_ps(total, s[i]);
  std::array<float, 16> lanes;
  _mm512_storeu_ps(lanes.data(), total);
  return add_up(lanes);
}

DAYLIT_AVX2 float sum_avx2(const std::byte* data, std::size_t size) {
  __m256 s[8];
  for (__m256& x : s)
    x = _mm256_setzero_ps();
  for (std::size_t k = 0; k + 256 <= size; k += 256)
#pragma GCC unroll 8
    for (int i = 0; i < 8; ++i)
      s[i] = _mm256_add_ps(s[i], _mm256_loadu_ps(reinterpret_cast<const float*>(data + k + 32 * i)));
  for (int i = 1; i < 8; ++i)
    s[0] = _mm256_add_ps(s[0], s[i]);
  std::array<float, 8> lanes;
  _mm256_storeu_ps(lanes.data(), s[0]);
  return add_up(lanes);
}

const std::array<TileKernels, 4> kAll{{
    {"baseline", add_baseline, add_fixed_baseline, dot_baseline, interleave_baseline<false>, interleave_baseline<true>,
     sum_baseline},
    {"avx2", add_avx2, add_fixed_avx2, dot_avx2, interleave_baseline<false>, interleave_baseline<true>, sum_avx2},
    {"avx512", add_avx512, add_fixed_avx512, dot_avx2, interleave_avx512<false>, interleave_avx512<true>, sum_avx512},
    {"avx512vnni", add_avx512, add_fixed_vnni, dot_avx2, interleave_avx512<false>, interleave_avx512<true>, sum_avx512},
}};

std::size_t usable_count() {
  __builtin_cpu_init();
  // Every processor with AVX2 converts half floats too.
  if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma"))
    return 1;
  const bool wide = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                    __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq");
  return !wide ? 2 : __builtin_cpu_supports("avx512vnni") ? 4 : 3;
}

} // namespace

std::span<const TileKernels> usable_tile_kernels() {
  static const std::size_t count = usable_count();
  return std::span(kAll).first(count);
}

const TileKernels& tile_kernels() {
  static const TileKernels& widest = usable_tile_kernels().back();
  return widest;
}

} // namespace daylit::detail
