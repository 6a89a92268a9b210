#include "scene/detail/lane_kernels.h"

#include "scene/detail/tile_kernels.h"

// GCC 12 warns about its own header (its bug 105593).
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#pragma GCC diagnostic ignored "-Wuninitialized"
#endif
#include <immintrin.h>

#define DAYLIT_AVX2 __attribute__((target("avx2,fma,f16c")))
#define DAYLIT_AVX512 __attribute__((target("avx512f,avx512bw,avx512vl,avx512dq,avx2,fma,f16c")))

namespace daylit::detail {

namespace {

/// One group of 16 lanes, two registers for each colour.
DAYLIT_AVX2 void add_lanes_avx2(const std::uint16_t* table, const float* rgb, std::size_t count, std::size_t groups,
                                float* sum) {
  for (std::size_t g = 0; g < groups; ++g) {
    __m256 s[3][2];
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t i = 0; i < 2; ++i)
        s[c][i] = _mm256_loadu_ps(sum + (c * groups + g) * kLanes + 8 * i);
    for (std::size_t k = 0; k < count; ++k) {
      const std::uint16_t* row = table + (k * groups + g) * kLanes;
      for (std::size_t i = 0; i < 2; ++i) {
        const __m256 x = _mm256_cvtph_ps(_mm_loadu_si128(reinterpret_cast<const __m128i*>(row + 8 * i)));
        for (std::size_t c = 0; c < 3; ++c)
          s[c][i] = _mm256_fmadd_ps(_mm256_broadcast_ss(rgb + 3 * k + c), x, s[c][i]);
      }
    }
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t i = 0; i < 2; ++i)
        _mm256_storeu_ps(sum + (c * groups + g) * kLanes + 8 * i, s[c][i]);
  }
}

template <int kGroups>
DAYLIT_AVX512 void add_groups(const std::uint16_t* table, const float* rgb, std::size_t count, float* sum) {
  __m512 s[3][kGroups];
#pragma GCC unroll 12
  for (int k = 0; k < 3 * kGroups; ++k)
    s[k / kGroups][k % kGroups] = _mm512_loadu_ps(sum + k * 16);
  for (std::size_t k = 0; k < count; ++k) {
    const std::uint16_t* row = table + k * kGroups * kLanes;
    const __m512 red = _mm512_set1_ps(rgb[3 * k]), green = _mm512_set1_ps(rgb[3 * k + 1]),
                 blue = _mm512_set1_ps(rgb[3 * k + 2]);
#pragma GCC unroll 4
    for (int g = 0; g < kGroups; ++g) {
      const __m512 x = _mm512_cvtph_ps(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(row + 16 * g)));
      s[0][g] = _mm512_fmadd_ps(red, x, s[0][g]);
      s[1][g] = _mm512_fmadd_ps(green, x, s[1][g]);
      s[2][g] = _mm512_fmadd_ps(blue, x, s[2][g]);
    }
  }
#pragma GCC unroll 12
  for (int k = 0; k < 3 * kGroups; ++k)
    _mm512_storeu_ps(sum + k * 16, s[k / kGroups][k % kGroups]);
}

void add_lanes_avx512(const std::uint16_t* table, const float* rgb, std::size_t count, std::size_t groups, float* sum) {
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

void add_lanes_plain(const std::uint16_t* table, const float* rgb, std::size_t count, std::size_t groups, float* sum) {
  for (std::size_t k = 0; k < count; ++k)
    for (std::size_t lane = 0; lane < groups * kLanes; ++lane)
      for (std::size_t c = 0; c < 3; ++c)
        sum[c * groups * kLanes + lane] += from_half(table[k * groups * kLanes + lane]) * rgb[3 * k + c];
}

AddLanes add_lanes_kernel() {
  const std::size_t widest = usable_tile_kernels().size(); // baseline, AVX2, AVX-512
  return widest >= 3 ? add_lanes_avx512 : widest == 2 ? add_lanes_avx2 : add_lanes_plain;
}

} // namespace daylit::detail
