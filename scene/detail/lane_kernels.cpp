#include "scene/detail/lane_kernels.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "scene/detail/wide_vectors.h"

#define DAYLIT_ANY_WIDTH __attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")))

namespace daylit::detail {

namespace {

constexpr std::size_t kColours = 3, kRegisters = kColours * kLaneRegions / 16;

/// Where each of 32 words (16 pairs of one colour) comes from: among the first 64 interleaved words, then the last 32.
struct PairWords {
  alignas(64) std::array<std::array<std::uint16_t, 32>, kColours> front, back;
  std::array<std::uint32_t, kColours> from_back; ///< bit k: word k comes from the last 32
};
constexpr PairWords pair_words() {
  PairWords t{};
  for (unsigned c = 0; c < kColours; ++c)
    for (unsigned k = 0; k < 32; ++k) {
      const unsigned word = 3 * k + c;
      t.front[c][k] = static_cast<std::uint16_t>(word % 64);
      t.back[c][k] = static_cast<std::uint16_t>(word % 32);
      t.from_back[c] |= word < 64 ? 0u : 1u << k;
    }
  return t;
}
constexpr PairWords kPairWords = pair_words();

/// Rounds the colours of `count` regions to pairs; returns the step, 0 for black.
DAYLIT_VNNI inline float round_pairs(const float* rgb, std::size_t count, std::int32_t pair[kColours][16]) {
  __m512 x[kRegisters], most = _mm512_setzero_ps();
  const std::size_t numbers = 3 * count;
#pragma GCC unroll 6
  for (std::size_t i = 0; i < kRegisters; ++i) {
    const std::size_t left = numbers > 16 * i ? numbers - 16 * i : 0;
    x[i] = _mm512_maskz_loadu_ps(static_cast<__mmask16>(left >= 16 ? 0xffffu : (1u << left) - 1u), rgb + 16 * i);
    most = _mm512_max_ps(most, _mm512_abs_ps(x[i]));
  }
  const float largest = _mm512_reduce_max_ps(most), step = largest / kLaneMost;
  if (!(step > 0))
    return 0;
  const __m512 inverse = _mm512_set1_ps(kLaneMost / largest);
  __m512i words[kRegisters / 2];
#pragma GCC unroll 3
  for (std::size_t i = 0; i < kRegisters / 2; ++i)
    words[i] = _mm512_inserti64x4(
        _mm512_castsi256_si512(_mm512_cvtepi32_epi16(_mm512_cvtps_epi32(_mm512_mul_ps(x[2 * i], inverse)))),
        _mm512_cvtepi32_epi16(_mm512_cvtps_epi32(_mm512_mul_ps(x[2 * i + 1], inverse))), 1);
#pragma GCC unroll 3
  for (std::size_t c = 0; c < kColours; ++c) {
    const __m512i front = _mm512_permutex2var_epi16(words[0], _mm512_load_si512(kPairWords.front[c].data()), words[1]);
    _mm512_store_si512(pair[c], _mm512_mask_permutexvar_epi16(front, kPairWords.from_back[c],
                                                              _mm512_load_si512(kPairWords.back[c].data()), words[2]));
  }
  return step;
}

template <int kGroups>
DAYLIT_VNNI void add_groups(const std::int8_t* table, const float* rgb, std::size_t count, float* sum) {
  alignas(64) std::int32_t pair[kColours][16];
  const float step = round_pairs(rgb, count, pair);
  if (step == 0)
    return;
  __m512i total[kColours][kGroups];
#pragma GCC unroll 12
  for (std::size_t k = 0; k < kColours * kGroups; ++k)
    total[k / kGroups][k % kGroups] = _mm512_setzero_si512();
  for (std::size_t p = 0; 2 * p < count; ++p) {
    const std::int8_t* row = table + p * kGroups * 2 * kLanes;
    const __m512i red = _mm512_set1_epi32(pair[0][p]), green = _mm512_set1_epi32(pair[1][p]),
                  blue = _mm512_set1_epi32(pair[2][p]);
#pragma GCC unroll 4
    for (int g = 0; g < kGroups; ++g) {
      const __m512i x = _mm512_cvtepi8_epi16(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(row + 32 * g)));
      total[0][g] = _mm512_dpwssd_epi32(total[0][g], x, red);
      total[1][g] = _mm512_dpwssd_epi32(total[1][g], x, green);
      total[2][g] = _mm512_dpwssd_epi32(total[2][g], x, blue);
    }
  }
#pragma GCC unroll 12
  for (std::size_t k = 0; k < kColours * kGroups; ++k)
    _mm512_storeu_ps(sum + 16 * k,
                     _mm512_fmadd_ps(_mm512_set1_ps(step), _mm512_cvtepi32_ps(total[k / kGroups][k % kGroups]),
                                     _mm512_loadu_ps(sum + 16 * k)));
}

DAYLIT_VNNI void add_lanes_vnni(const std::int8_t* table, const float* rgb, std::size_t count, std::size_t groups,
                                float* sum) {
  switch (groups) {
  case 1:
    return add_groups<1>(table, rgb, count, sum);
  case 2:
    return add_groups<2>(table, rgb, count, sum);
  case 3:
    return add_groups<3>(table, rgb, count, sum);
  default:
    return add_groups<4>(table, rgb, count, sum);
  }
}

} // namespace

DAYLIT_ANY_WIDTH void add_lanes_plain(const std::int8_t* table, const float* rgb, std::size_t count, std::size_t groups,
                                      float* sum) {
  float most = 0;
  for (std::size_t k = 0; k < 3 * count; ++k)
    most = std::max(most, std::abs(rgb[k]));
  const float step = most / kLaneMost;
  if (!(step > 0))
    return;
  std::array<std::int32_t, kColours * kLaneRegions + kColours> rounded{};
  for (std::size_t k = 0; k < 3 * count; ++k)
    rounded[k] = static_cast<std::int32_t>(std::lrint(rgb[k] * (kLaneMost / most)));
  const std::size_t lanes = groups * kLanes;
  std::array<std::int32_t, kColours * kMostGroups * kLanes> total{};
  for (std::size_t k = 0; k < count; k += 2)
    for (std::size_t c = 0; c < kColours; ++c) {
      const std::int32_t even = rounded[3 * k + c], odd = rounded[3 * k + 3 + c];
      for (std::size_t lane = 0; lane < lanes; ++lane)
        total[c * lanes + lane] += even * table[k * lanes + 2 * lane] + odd * table[k * lanes + 2 * lane + 1];
    }
  for (std::size_t k = 0; k < kColours * lanes; ++k)
    sum[k] += step * static_cast<float>(total[k]);
}

AddLanes add_lanes_kernel() {
  __builtin_cpu_init();
  const bool vnni = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                    __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq") &&
                    __builtin_cpu_supports("avx512vnni");
  return vnni ? add_lanes_vnni : add_lanes_plain;
}

} // namespace daylit::detail
