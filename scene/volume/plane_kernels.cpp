#include "scene/volume/plane_kernels.h"

#include <algorithm>
#include <array>

#include "scene/core/tile_kernels.h"
#include "scene/core/wide_vectors.h"

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
          total += weight_of(weight[k].colour[c], i) * factor[(quad[k] * planes + plane) * kQuad + i];
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
DAYLIT_AVX2 DAYLIT_INLINE WideWeights widen(const QuadWeights& w) {
  const __m256i h = _mm256_set1_epi32(w.high), l = _mm256_set1_epi32(w.low);
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
          total[c] = _mm256_add_epi32(total[c], product(x, widen(weight[k].colour[c])));
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
      const WideWeights w = widen(weight[q]);
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

/// -128 times the sums of the weights, limb by limb: lane k is for word k of every eight, which `weight` is made of.
DAYLIT_VNNI DAYLIT_INLINE __m256i offsets(const std::int32_t* weight, std::size_t words) {
  __m512i total[2] = {_mm512_setzero_si512(), _mm512_setzero_si512()};
  const __m512i ones = _mm512_set1_epi8(1);
  for (std::size_t k = 0; k < words; k += 32)
#pragma GCC unroll 2
    for (std::size_t i = 0; i < 2; ++i) {
      const std::size_t left = words > k + 16 * i ? words - k - 16 * i : 0;
      const auto in = static_cast<__mmask16>(left >= 16 ? 0xffffu : (1u << left) - 1u);
      total[i] = _mm512_dpbusd_epi32(total[i], ones, _mm512_maskz_loadu_epi32(in, weight + k + 16 * i));
    }
  const __m512i both = _mm512_add_epi32(total[0], total[1]);
  const __m256i sum = _mm256_add_epi32(_mm512_castsi512_si256(both), _mm512_extracti64x4_epi64(both, 1));
  return _mm256_slli_epi32(_mm256_sub_epi32(_mm256_setzero_si256(), sum), 7);
}

/// 16 kGroups planes from `factor` on, of the last 16 those of `last`. `offset`: as ColourWeights; added at the end, so
/// that the sums need not wait for it.
template <std::size_t kGroups>
DAYLIT_VNNI void groups_vnni(const std::int8_t* factor, std::size_t planes, __mmask16 last,
                             std::span<const std::uint32_t> quad, const ColourWeights* weight,
                             const std::int32_t* offset, float* sum) {
  const auto lanes = [last](std::size_t g) { return g + 1 < kGroups ? __mmask16{0xffff} : last; };
  __m512i high[kColours * kGroups], low[kColours * kGroups];
#pragma GCC unroll 12
  for (std::size_t i = 0; i < kColours * kGroups; ++i)
    high[i] = low[i] = _mm512_setzero_si512();
  for (std::size_t k = 0; k < quad.size(); ++k) {
    const std::int8_t* row = factor + quad[k] * planes * kQuad;
#pragma GCC unroll 4
    for (std::size_t g = 0; g < kGroups; ++g) {
      const __m512i x = load_offset(row + g * kRegisterBytes, lanes(g));
#pragma GCC unroll 3
      for (std::size_t c = 0; c < kColours; ++c) {
        const std::size_t i = c * kGroups + g;
        add_byte_products(high[i], x, _mm512_set1_epi32(weight[k].colour[c].high));
        add_byte_products(low[i], x, _mm512_set1_epi32(weight[k].colour[c].low));
      }
    }
  }
#pragma GCC unroll 12
  for (std::size_t i = 0; i < kColours * kGroups; ++i) {
    const std::size_t c = i / kGroups, g = i % kGroups;
    add_limbs(sum + c * planes + g * kLanes16, _mm512_add_epi32(high[i], _mm512_set1_epi32(offset[2 * c])),
              _mm512_add_epi32(low[i], _mm512_set1_epi32(offset[2 * c + 1])), lanes(g));
  }
}

DAYLIT_VNNI void planes_vnni(const std::int8_t* factor, std::size_t planes, std::span<const std::uint32_t> quad,
                             const ColourWeights* weight, float* sum) {
  alignas(32) std::int32_t offset[8];
  _mm256_store_si256(reinterpret_cast<__m256i*>(offset), offsets(&weight->colour[0].high, 8 * quad.size()));
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

/// 16 kRegisters numbers from `tile` on. The offsets: -128 times the sums of the limbs.
template <std::size_t kRegisters>
DAYLIT_VNNI void some_numbers_vnni(const std::int8_t* tile, std::size_t numbers, std::span<const QuadWeights> weight,
                                   __m512i high_offset, __m512i low_offset, float* sum) {
  __m512i high[kRegisters], low[kRegisters];
#pragma GCC unroll 8
  for (std::size_t r = 0; r < kRegisters; ++r) {
    high[r] = high_offset;
    low[r] = low_offset;
  }
  for (std::size_t q = 0; q < weight.size(); ++q) {
    const __m512i h = _mm512_set1_epi32(weight[q].high), l = _mm512_set1_epi32(weight[q].low);
#pragma GCC unroll 8
    for (std::size_t r = 0; r < kRegisters; ++r) {
      const __m512i x = load_offset(tile + q * numbers * kQuad + r * kRegisterBytes);
      add_byte_products(high[r], x, h);
      add_byte_products(low[r], x, l);
    }
  }
#pragma GCC unroll 8
  for (std::size_t r = 0; r < kRegisters; ++r)
    add_limbs(sum + 16 * r, high[r], low[r]);
}

DAYLIT_VNNI void numbers_vnni(const std::int8_t* tile, std::size_t numbers, std::span<const QuadWeights> weight,
                              float* sum) {
  if (weight.empty())
    return;
  // Words 0, 2, 4, 6 of every eight are high limbs, the others low ones.
  const __m256i eight = offsets(&weight.data()->high, 2 * weight.size());
  const __m128i four = _mm_add_epi32(_mm256_castsi256_si128(eight), _mm256_extracti128_si256(eight, 1)),
                two = _mm_add_epi32(four, _mm_shuffle_epi32(four, 0x4e));
  const __m512i high = _mm512_broadcastd_epi32(two), low = _mm512_broadcastd_epi32(_mm_shuffle_epi32(two, 0x55));
  if (numbers == kTileNumbers)
    return some_numbers_vnni<8>(tile, numbers, weight, high, low, sum);
  for (std::size_t first = 0; first < numbers; first += 16)
    some_numbers_vnni<1>(tile + first * kQuad, numbers, weight, high, low, sum + first);
}

constexpr std::array<PlaneKernels, 3> kAll{{{"baseline", planes_baseline, numbers_baseline, round_quads_baseline},
                                            {"avx2", planes_avx2, numbers_avx2, round_quads_baseline},
                                            {"avx512vnni", planes_vnni, numbers_vnni, round_quads_avx512}}};

} // namespace

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

const PlaneKernels& plane_kernels() {
  static const PlaneKernels& widest = usable_plane_kernels().back();
  return widest;
}

} // namespace daylit::detail
