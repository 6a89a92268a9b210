#include "scene/volume/plane_weights.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "scene/core/wide_vectors.h"

#define DAYLIT_ANY_WIDTH __attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")))

namespace daylit::detail {

namespace {

constexpr std::size_t kColours = 3;
constexpr float kUlpIsOne = 12582912.0f; ///< added and subtracted: to the nearest integer, below 2^22

/// Two limbs of `weight` in steps of 1 / `per_step`.
DAYLIT_INLINE std::int32_t rounded(float weight, float per_step) {
  return std::bit_cast<std::int32_t>(weight * per_step + kUlpIsOne) - std::bit_cast<std::int32_t>(kUlpIsOne);
}
DAYLIT_INLINE std::uint32_t high_byte(std::int32_t x) { return static_cast<std::uint32_t>((x + 128) >> 8) & 0xffu; }
DAYLIT_INLINE std::uint32_t low_byte(std::int32_t x) { return static_cast<std::uint32_t>(x) & 0xffu; } // -128 to 127
DAYLIT_INLINE std::uint32_t limbs(std::int32_t x) { return high_byte(x) | low_byte(x) << 8; }

DAYLIT_ANY_WIDTH void largest_of(std::span<const Rgb> weight, float most[kColours]) {
  float r = 0, g = 0, b = 0;
  for (const Rgb& w : weight) {
    r = std::max(r, std::abs(w.r));
    g = std::max(g, std::abs(w.g));
    b = std::max(b, std::abs(w.b));
  }
  most[0] = r, most[1] = g, most[2] = b;
}

DAYLIT_ANY_WIDTH void round_colours(std::span<const Rgb> weight, const float per_step[kColours], std::uint64_t* entry) {
  for (std::size_t k = 0; k < weight.size(); ++k) {
    const std::uint32_t first = limbs(rounded(weight[k].r, per_step[0])) | limbs(rounded(weight[k].g, per_step[1]))
                                                                               << 16;
    entry[k] = std::uint64_t{limbs(rounded(weight[k].b, per_step[2]))} << 32 | first;
  }
}

/// 0 where the weights are black or cannot be divided.
float per_step_of(float most) {
  const float per_step = static_cast<float>(kWeightMost) / most;
  return most > 0 && std::isfinite(per_step) ? per_step : 0.0f;
}

float step_of(float most) { return per_step_of(most) > 0 ? most / static_cast<float>(kWeightMost) : 0.0f; }

/// Puts a weight beside the others of its quad.
void add_weight(std::int32_t x, std::size_t k, QuadWeights& quad) {
  quad.high |= static_cast<std::int32_t>(high_byte(x) << (8 * k));
  quad.low |= static_cast<std::int32_t>(low_byte(x) << (8 * k));
}

/// From entries at[0] to at[3] of RoundedColours to a quad; false if all are 0.
DAYLIT_INLINE bool transpose(const std::uint64_t* entry, const std::uint32_t* at, ColourWeights& quad) {
  const auto load = [&](std::size_t k) { return _mm_cvtsi64_si128(static_cast<long long>(entry[at[k]])); };
  const __m128i even = _mm_unpacklo_epi8(load(0), load(1)), odd = _mm_unpacklo_epi8(load(2), load(3));
  auto* const to = reinterpret_cast<__m128i*>(&quad);
  _mm_store_si128(to, _mm_unpacklo_epi16(even, odd));
  _mm_store_si128(to + 1, _mm_unpackhi_epi16(even, odd));
  return (entry[at[0]] | entry[at[1]] | entry[at[2]] | entry[at[3]]) != 0;
}

/// Where the 12 words of two quads come from among those of four, colours interleaved, and the order of their bytes.
struct QuadWords {
  alignas(64) std::array<std::uint16_t, 32> first{}, second{};
  alignas(64) std::array<std::uint8_t, 64> byte{};
};
constexpr QuadWords quad_words() {
  QuadWords t;
  for (unsigned k = 0; k < 32; ++k) {
    const unsigned quad = k / 16, colour = k / 4 % 4;
    const unsigned word = colour < kColours ? 12 * quad + 3 * (k % 4) + colour : 0;
    t.first[k] = static_cast<std::uint16_t>(word);
    t.second[k] = static_cast<std::uint16_t>(24 + word);
  }
  for (unsigned k = 0; k < 64; ++k) { // of each word the high byte, then of the same words the low byte
    const unsigned in_lane = k % 16, word = in_lane / 8 * 4 + k % 4;
    t.byte[k] = static_cast<std::uint8_t>(k % 32 >= 24 ? 0x80u : 2 * word + (in_lane % 8 < 4 ? 1u : 0u));
  }
  return t;
}
constexpr QuadWords kQuadWords = quad_words();

/// Sixteen numbers or what is left of them, as words.
DAYLIT_AVX512 DAYLIT_INLINE __mmask16 some_of(std::size_t left) {
  return static_cast<__mmask16>(left >= 16 ? 0xffffu : (1u << left) - 1u);
}
DAYLIT_AVX512 DAYLIT_INLINE __m256i words_at(const float* from, std::size_t left, __m512 per_step) {
  return _mm512_cvtepi32_epi16(_mm512_cvtps_epi32(_mm512_mul_ps(_mm512_maskz_loadu_ps(some_of(left), from), per_step)));
}
DAYLIT_AVX512 float largest_of(const float* from, std::size_t numbers) {
  __m512 most[4] = {_mm512_setzero_ps(), _mm512_setzero_ps(), _mm512_setzero_ps(), _mm512_setzero_ps()};
  std::size_t k = 0;
  for (; k + 64 <= numbers; k += 64)
#pragma GCC unroll 4
    for (std::size_t i = 0; i < 4; ++i)
      most[i] = _mm512_max_ps(most[i], _mm512_abs_ps(_mm512_loadu_ps(from + k + 16 * i)));
  for (; k < numbers; k += 16)
    most[0] = _mm512_max_ps(most[0], _mm512_abs_ps(_mm512_maskz_loadu_ps(some_of(numbers - k), from + k)));
  return _mm512_reduce_max_ps(_mm512_max_ps(_mm512_max_ps(most[0], most[1]), _mm512_max_ps(most[2], most[3])));
}
/// From the bytes of x to its limbs: the low one borrows from the high one where it is negative.
DAYLIT_AVX512 DAYLIT_INLINE __m512i limbs_of(__m512i x) {
  const __m512i half = _mm512_set1_epi16(128);
  return _mm512_xor_si512(_mm512_add_epi16(x, half), half);
}

} // namespace

RoundedWeights::RoundedWeights(std::span<const float> weight) : quad((weight.size() + kQuad - 1) / kQuad) {
  float most = 0;
  for (const float w : weight)
    most = std::max(most, std::abs(w));
  const float per_step = per_step_of(most);
  step = step_of(most);
  for (std::size_t k = 0; k < weight.size() && step > 0; ++k)
    add_weight(rounded(weight[k], per_step), k % kQuad, quad[k / kQuad]);
}

RoundedColours::RoundedColours(std::span<const Rgb> weight) : entry(weight.size()) {
  float most[kColours], per_step[kColours];
  largest_of(weight, most);
  for (std::size_t c = 0; c < kColours; ++c) {
    per_step[c] = per_step_of(most[c]);
    step[c] = step_of(most[c]);
  }
  round_colours(weight, per_step, entry.data());
}

LitQuads RoundedColours::lit_quads(std::span<const std::uint32_t> list) const {
  LitQuads lit;
  lit.quad.resize((list.size() + kQuad - 1) / kQuad);
  lit.weight.resize(lit.quad.size());
  std::size_t count = 0;
  for (std::size_t q = 0; q < lit.quad.size(); ++q) {
    std::uint32_t last[kQuad];
    const std::uint32_t* at = list.data() + q * kQuad;
    if (const std::size_t left = list.size() - q * kQuad; left < kQuad) {
      for (std::size_t i = 0; i < kQuad; ++i)
        last[i] = at[std::min(i, left - 1)];
      at = last;
    }
    lit.quad[count] = static_cast<std::uint32_t>(q);
    count += transpose(entry.data(), at, lit.weight[count]) ? 1 : 0;
  }
  lit.quad.resize(count);
  lit.weight.resize(count);
  return lit;
}

float round_quads_baseline(std::span<const Rgb> colour, ColourWeights* quad) {
  std::fill_n(quad, (colour.size() + 15) / 16 * 4, ColourWeights{});
  float most = 0;
  for (const Rgb& x : colour)
    most = std::max({most, std::abs(x.r), std::abs(x.g), std::abs(x.b)});
  const float per_step = per_step_of(most), step = step_of(most);
  for (std::size_t k = 0; k < colour.size() && step > 0; ++k)
    for (int c = 0; c < 3; ++c)
      add_weight(rounded(colour[k][c], per_step), k % kQuad, quad[k / kQuad].colour[c]);
  return step;
}

DAYLIT_AVX512 float round_quads_avx512(std::span<const Rgb> colour, ColourWeights* quad) {
  const float* from = &colour.data()->r;
  const std::size_t numbers = kColours * colour.size();
  const float most = largest_of(from, numbers), step = step_of(most);
  const __m512 per_step = _mm512_set1_ps(per_step_of(most));
  const __m512i first = _mm512_load_si512(kQuadWords.first.data()),
                second = _mm512_load_si512(kQuadWords.second.data()), order = _mm512_load_si512(kQuadWords.byte.data());
  for (std::size_t k = 0; k < numbers; k += 48, quad += 4) {
    const auto left = [&](std::size_t words) { return numbers > k + words ? numbers - k - words : 0; };
    const __m512i front = limbs_of(_mm512_inserti64x4(_mm512_castsi256_si512(words_at(from + k, left(0), per_step)),
                                                      words_at(from + k + 16, left(16), per_step), 1));
    const __m512i back = limbs_of(_mm512_castsi256_si512(words_at(from + k + 32, left(32), per_step)));
    _mm512_storeu_si512(quad, _mm512_shuffle_epi8(_mm512_permutexvar_epi16(first, front), order));
    _mm512_storeu_si512(quad + 2, _mm512_shuffle_epi8(_mm512_permutex2var_epi16(front, second, back), order));
  }
  return step;
}

} // namespace daylit::detail
