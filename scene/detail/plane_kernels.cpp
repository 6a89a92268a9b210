#include "scene/detail/plane_kernels.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "scene/detail/tile_kernels.h"
#include "scene/detail/wide_vectors.h"

#define DAYLIT_INLINE inline __attribute__((always_inline))
#define DAYLIT_ANY_WIDTH __attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")))

namespace daylit::detail {

namespace {

constexpr std::size_t kColours = 3, kLanes16 = 16, kRegisterBytes = 64;

std::int32_t byte_of(std::int32_t word, std::size_t k) {
  return static_cast<std::int8_t>(static_cast<std::uint32_t>(word) >> (8 * k));
}
std::int32_t weight_of(const QuadWeights& w, std::size_t k) { return 256 * byte_of(w.high, k) + byte_of(w.low, k); }

void planes_baseline(const std::int8_t* factor, std::size_t planes, std::span<const std::uint32_t> quad,
                     const ColourWeights* weight, float* sum) {
  for (std::size_t c = 0; c < kColours; ++c)
    for (std::size_t plane = 0; plane < planes; ++plane) {
      std::int64_t total = 0;
      for (std::size_t k = 0; k < quad.size(); ++k)
        for (std::size_t i = 0; i < kQuad; ++i)
          total += weight_of({weight[k].high[c], weight[k].low[c]}, i) * factor[(quad[k] * planes + plane) * kQuad + i];
      sum[c * planes + plane] += static_cast<float>(total);
    }
}

void numbers_baseline(const std::int8_t* tile, std::size_t numbers, std::span<const QuadWeights> weight, float* sum) {
  for (std::size_t n = 0; n < numbers; ++n) {
    std::int64_t total = 0;
    for (std::size_t q = 0; q < weight.size(); ++q)
      for (std::size_t i = 0; i < kQuad; ++i)
        total += weight_of(weight[q], i) * tile[(q * numbers + n) * kQuad + i];
    sum[n] += static_cast<float>(total);
  }
}

// Weights of 16 bits for the even and the odd bytes of eight quads. Integer sums hold kQuadsOfWords quads: a product is
// at most 2^7 kWeightMost.
constexpr std::size_t kQuadsOfWords = 128;

struct WideWeights {
  __m256i even, odd;
};
DAYLIT_AVX2 DAYLIT_INLINE __m256i even_bytes(__m256i x) { return _mm256_srai_epi16(_mm256_slli_epi16(x, 8), 8); }
DAYLIT_AVX2 DAYLIT_INLINE __m256i odd_bytes(__m256i x) { return _mm256_srai_epi16(x, 8); }
DAYLIT_AVX2 DAYLIT_INLINE WideWeights widen(std::int32_t high, std::int32_t low) {
  const __m256i h = _mm256_set1_epi32(high), l = _mm256_set1_epi32(low);
  return {_mm256_add_epi16(_mm256_slli_epi16(h, 8), even_bytes(l)),
          _mm256_add_epi16(_mm256_slli_epi16(odd_bytes(h), 8), odd_bytes(l))};
}
DAYLIT_AVX2 DAYLIT_INLINE __m256i product(__m256i x, const WideWeights& w) {
  return _mm256_add_epi32(_mm256_madd_epi16(even_bytes(x), w.even), _mm256_madd_epi16(odd_bytes(x), w.odd));
}
DAYLIT_AVX2 DAYLIT_INLINE void add_to(float* sum, __m256i total) {
  _mm256_storeu_ps(sum, _mm256_add_ps(_mm256_loadu_ps(sum), _mm256_cvtepi32_ps(total)));
}
DAYLIT_AVX2 DAYLIT_INLINE __m256i load32(const std::int8_t* p) {
  return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(p));
}

/// Eight planes; the last four may lie beyond the end and are not stored.
DAYLIT_AVX2 DAYLIT_INLINE __m256i load_planes(const std::int8_t* p, bool all) {
  const auto* from = reinterpret_cast<const __m128i*>(p);
  return all ? load32(p) : _mm256_castsi128_si256(_mm_loadu_si128(from));
}

DAYLIT_AVX2 void planes_avx2(const std::int8_t* factor, std::size_t planes, std::span<const std::uint32_t> quad,
                             const ColourWeights* weight, float* sum) {
  for (std::size_t begin = 0; begin < quad.size(); begin += kQuadsOfWords)
    for (std::size_t plane = 0; plane < planes; plane += 8) {
      const bool all = plane + 8 <= planes;
      __m256i total[kColours] = {_mm256_setzero_si256(), _mm256_setzero_si256(), _mm256_setzero_si256()};
      for (std::size_t k = begin; k < std::min(begin + kQuadsOfWords, quad.size()); ++k) {
        const __m256i x = load_planes(factor + (quad[k] * planes + plane) * kQuad, all);
#pragma GCC unroll 3
        for (std::size_t c = 0; c < kColours; ++c)
          total[c] = _mm256_add_epi32(total[c], product(x, widen(weight[k].high[c], weight[k].low[c])));
      }
      for (std::size_t c = 0; c < kColours; ++c) {
        float part[8] = {};
        add_to(part, total[c]);
        for (std::size_t i = 0; i < (all ? 8u : 4u); ++i)
          sum[c * planes + plane + i] += part[i];
      }
    }
}

/// 8 kRegisters numbers from `tile` on.
template <std::size_t kRegisters>
DAYLIT_AVX2 void some_numbers_avx2(const std::int8_t* tile, std::size_t numbers, std::span<const QuadWeights> weight,
                                   float* sum) {
  for (std::size_t begin = 0; begin < weight.size(); begin += kQuadsOfWords) {
    __m256i total[kRegisters];
#pragma GCC unroll 8
    for (__m256i& t : total)
      t = _mm256_setzero_si256();
    for (std::size_t q = begin; q < std::min(begin + kQuadsOfWords, weight.size()); ++q) {
      const WideWeights w = widen(weight[q].high, weight[q].low);
      const std::int8_t* from = tile + q * numbers * kQuad;
#pragma GCC unroll 8
      for (std::size_t r = 0; r < kRegisters; ++r)
        total[r] = _mm256_add_epi32(total[r], product(load32(from + 32 * r), w));
    }
#pragma GCC unroll 8
    for (std::size_t r = 0; r < kRegisters; ++r)
      add_to(sum + 8 * r, total[r]);
  }
}

void numbers_avx2(const std::int8_t* tile, std::size_t numbers, std::span<const QuadWeights> weight, float* sum) {
  std::size_t first = 0;
  for (; first + 64 <= numbers; first += 64)
    some_numbers_avx2<8>(tile + first * kQuad, numbers, weight, sum + first);
  for (; first < numbers; first += 16)
    some_numbers_avx2<2>(tile + first * kQuad, numbers, weight, sum + first);
}

// One operand of the instruction is unsigned: 128 is added to the bytes, and 128 times the weights taken off.

constexpr std::size_t kBytesAhead = 2048; ///< hardware prefetch stops at every page

DAYLIT_VNNI DAYLIT_INLINE __m512i load_offset(const std::int8_t* p, __mmask16 lanes = 0xffff) {
  _mm_prefetch(reinterpret_cast<const char*>(p + kBytesAhead), _MM_HINT_T0);
  return _mm512_xor_si512(_mm512_maskz_loadu_epi32(lanes, p), _mm512_set1_epi8(-128));
}
DAYLIT_VNNI DAYLIT_INLINE void add_limbs(float* sum, __m512i high, __m512i low, __mmask16 lanes = 0xffff) {
  const __m512 total = _mm512_fmadd_ps(_mm512_set1_ps(256.0f), _mm512_cvtepi32_ps(high), _mm512_cvtepi32_ps(low));
  _mm512_mask_storeu_ps(sum, lanes, _mm512_add_ps(_mm512_maskz_loadu_ps(lanes, sum), total));
}

/// 16 kGroups planes from `factor` on, of the last 16 those of `last`. `offset`: -128 times the sums of the weights, as
/// ColourWeights.
template <std::size_t kGroups>
DAYLIT_VNNI void groups_vnni(const std::int8_t* factor, std::size_t planes, __mmask16 last,
                             std::span<const std::uint32_t> quad, const ColourWeights* weight,
                             const std::int32_t* offset, float* sum) {
  constexpr std::size_t kLimbs = 2 * kColours;
  const auto lanes = [last](std::size_t g) { return g + 1 < kGroups ? __mmask16{0xffff} : last; };
  __m512i total[kLimbs][kGroups];
#pragma GCC unroll 24
  for (std::size_t i = 0; i < kLimbs * kGroups; ++i)
    total[i / kGroups][i % kGroups] = _mm512_set1_epi32(offset[i / kGroups]);
  for (std::size_t k = 0; k < quad.size(); ++k) {
    const std::int8_t* row = factor + quad[k] * planes * kQuad;
#pragma GCC unroll 4
    for (std::size_t g = 0; g < kGroups; ++g) {
      const __m512i x = load_offset(row + g * kRegisterBytes, lanes(g));
#pragma GCC unroll 3
      for (std::size_t c = 0; c < kColours; ++c) {
        total[c][g] = _mm512_dpbusd_epi32(total[c][g], x, _mm512_set1_epi32(weight[k].high[c]));
        total[kColours + c][g] = _mm512_dpbusd_epi32(total[kColours + c][g], x, _mm512_set1_epi32(weight[k].low[c]));
      }
    }
  }
#pragma GCC unroll 12
  for (std::size_t i = 0; i < kColours * kGroups; ++i)
    add_limbs(sum + i / kGroups * planes + i % kGroups * kLanes16, total[i / kGroups][i % kGroups],
              total[kColours + i / kGroups][i % kGroups], lanes(i % kGroups));
}

DAYLIT_VNNI void planes_vnni(const std::int8_t* factor, std::size_t planes, std::span<const std::uint32_t> quad,
                             const ColourWeights* weight, float* sum) {
  __m256i total = _mm256_setzero_si256();
  for (std::size_t k = 0; k < quad.size(); ++k)
    total = _mm256_dpbusd_epi32(total, _mm256_set1_epi8(1),
                                _mm256_load_si256(reinterpret_cast<const __m256i*>(weight + k)));
  alignas(32) std::int32_t offset[8];
  _mm256_store_si256(reinterpret_cast<__m256i*>(offset),
                     _mm256_slli_epi32(_mm256_sub_epi32(_mm256_setzero_si256(), total), 7));
  using Pass = void (*)(const std::int8_t*, std::size_t, __mmask16, std::span<const std::uint32_t>,
                        const ColourWeights*, const std::int32_t*, float*);
  constexpr std::array<Pass, 4> kPasses{groups_vnni<1>, groups_vnni<2>, groups_vnni<3>, groups_vnni<4>};
  for (std::size_t first = 0; first < planes;) {
    const std::size_t count = std::min((planes - first + kLanes16 - 1) / kLanes16, kPasses.size()),
                      in_last = std::min(planes - first - (count - 1) * kLanes16, kLanes16);
    kPasses[count - 1](factor + first * kQuad, planes, static_cast<__mmask16>((1u << in_last) - 1u), quad, weight,
                       offset, sum + first);
    first += count * kLanes16;
  }
}

/// 16 kRegisters numbers from `tile` on.
template <std::size_t kRegisters>
DAYLIT_VNNI void some_numbers_vnni(const std::int8_t* tile, std::size_t numbers, std::span<const QuadWeights> weight,
                                   float* sum) {
  std::int32_t offset[2] = {};
  for (const QuadWeights& w : weight)
    for (std::size_t i = 0; i < kQuad; ++i) {
      offset[0] -= 128 * byte_of(w.high, i);
      offset[1] -= 128 * byte_of(w.low, i);
    }
  __m512i high[kRegisters], low[kRegisters];
#pragma GCC unroll 8
  for (std::size_t r = 0; r < kRegisters; ++r) {
    high[r] = _mm512_set1_epi32(offset[0]);
    low[r] = _mm512_set1_epi32(offset[1]);
  }
  for (std::size_t q = 0; q < weight.size(); ++q) {
    const __m512i h = _mm512_set1_epi32(weight[q].high), l = _mm512_set1_epi32(weight[q].low);
#pragma GCC unroll 8
    for (std::size_t r = 0; r < kRegisters; ++r) {
      const __m512i x = load_offset(tile + q * numbers * kQuad + r * kRegisterBytes);
      high[r] = _mm512_dpbusd_epi32(high[r], x, h);
      low[r] = _mm512_dpbusd_epi32(low[r], x, l);
    }
  }
#pragma GCC unroll 8
  for (std::size_t r = 0; r < kRegisters; ++r)
    add_limbs(sum + 16 * r, high[r], low[r]);
}

void numbers_vnni(const std::int8_t* tile, std::size_t numbers, std::span<const QuadWeights> weight, float* sum) {
  if (numbers == kTileNumbers)
    return some_numbers_vnni<8>(tile, numbers, weight, sum);
  for (std::size_t first = 0; first < numbers; first += 16)
    some_numbers_vnni<1>(tile + first * kQuad, numbers, weight, sum + first);
}

constexpr float kUlpIsOne = 12582912.0f; ///< added and subtracted: to the nearest integer, below 2^22

/// Two limbs of `weight` in steps of 1 / `per_step`.
DAYLIT_INLINE std::int32_t rounded(float weight, float per_step) {
  return std::bit_cast<std::int32_t>(weight * per_step + kUlpIsOne) - std::bit_cast<std::int32_t>(kUlpIsOne);
}
DAYLIT_INLINE std::uint32_t high_byte(std::int32_t x) { return static_cast<std::uint32_t>((x + 128) >> 8) & 0xffu; }
DAYLIT_INLINE std::uint32_t low_byte(std::int32_t x) { return static_cast<std::uint32_t>(x) & 0xffu; } // -128 to 127

DAYLIT_ANY_WIDTH void largest_of(std::span<const std::array<float, 3>> weight, float most[kColours]) {
  float r = 0, g = 0, b = 0;
  for (const std::array<float, 3>& w : weight) {
    r = std::max(r, std::abs(w[0]));
    g = std::max(g, std::abs(w[1]));
    b = std::max(b, std::abs(w[2]));
  }
  most[0] = r, most[1] = g, most[2] = b;
}

DAYLIT_ANY_WIDTH void round_colours(std::span<const std::array<float, 3>> weight, const float per_step[kColours],
                                    std::uint64_t* entry) {
  for (std::size_t k = 0; k < weight.size(); ++k) {
    const std::int32_t r = rounded(weight[k][0], per_step[0]), g = rounded(weight[k][1], per_step[1]),
                       b = rounded(weight[k][2], per_step[2]);
    const std::uint32_t first = high_byte(r) | high_byte(g) << 8 | high_byte(b) << 16 | low_byte(r) << 24,
                        second = low_byte(g) | low_byte(b) << 8;
    entry[k] = std::uint64_t{second} << 32 | first;
  }
}

/// 0 where the weights are black or cannot be divided.
float per_step_of(float most) {
  const float per_step = static_cast<float>(kWeightMost) / most;
  return most > 0 && std::isfinite(per_step) ? per_step : 0.0f;
}

constexpr std::array<PlaneKernels, 3> kAll{{{"baseline", planes_baseline, numbers_baseline},
                                            {"avx2", planes_avx2, numbers_avx2},
                                            {"avx512vnni", planes_vnni, numbers_vnni}}};

} // namespace

RoundedWeights::RoundedWeights(std::span<const float> weight) : quad((weight.size() + kQuad - 1) / kQuad) {
  float most = 0;
  for (const float w : weight)
    most = std::max(most, std::abs(w));
  const float per_step = per_step_of(most);
  if (per_step == 0.0f)
    return;
  step = most / static_cast<float>(kWeightMost);
  for (std::size_t k = 0; k < weight.size(); ++k) {
    const std::int32_t x = rounded(weight[k], per_step);
    QuadWeights& q = quad[k / kQuad];
    q.high |= static_cast<std::int32_t>(high_byte(x) << (8 * (k % kQuad)));
    q.low |= static_cast<std::int32_t>(low_byte(x) << (8 * (k % kQuad)));
  }
}

RoundedColours::RoundedColours(std::span<const std::array<float, 3>> weight) : entry(weight.size()) {
  float most[kColours], per_step[kColours];
  largest_of(weight, most);
  for (std::size_t c = 0; c < kColours; ++c) {
    per_step[c] = per_step_of(most[c]);
    step[c] = per_step[c] > 0 ? most[c] / static_cast<float>(kWeightMost) : 0.0f;
  }
  round_colours(weight, per_step, entry.data());
}

ColourWeights RoundedColours::quad(const std::uint32_t* at) const {
  const auto load = [&](std::size_t k) {
    return _mm_loadl_epi64(reinterpret_cast<const __m128i*>(entry.data() + at[k]));
  };
  const __m128i even = _mm_unpacklo_epi8(load(0), load(1)), odd = _mm_unpacklo_epi8(load(2), load(3));
  ColourWeights out;
  _mm_store_si128(reinterpret_cast<__m128i*>(&out), _mm_unpacklo_epi16(even, odd));
  _mm_store_si128(reinterpret_cast<__m128i*>(&out) + 1, _mm_unpackhi_epi16(even, odd));
  return out;
}

std::span<const PlaneKernels> usable_plane_kernels() {
  static const std::size_t count = [] {
    __builtin_cpu_init();
    if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma"))
      return 1;
    const bool wide = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                      __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq") &&
                      __builtin_cpu_supports("avx512vnni");
    return wide ? 3 : 2;
  }();
  return std::span(kAll).first(count);
}

const PlaneKernels& plane_kernels() { return usable_plane_kernels().back(); }

} // namespace daylit::detail
