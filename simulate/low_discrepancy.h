#pragma once

// Counter-based sample points: every number is a pure function of (key, sample index, dimension pair), so that
// results do not depend on the order of evaluation. Two-dimensional Sobol points, nested uniform (Owen) scrambling by
// hashing, pairs decorrelated by shuffling the index (Burley 2020, "Practical Hash-based Owen Scrambling").

#include <cstdint>

#include <glm/vec2.hpp>

namespace daylit {

/// Well-mixed 32 bits of a 64-bit counter (the finaliser of SplitMix64, Steele et al. 2014).
constexpr std::uint32_t mix_bits(std::uint64_t x) {
  x += 0x9E3779B97F4A7C15ull;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ull;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBull;
  return static_cast<std::uint32_t>((x ^ (x >> 31)) >> 32);
}
constexpr std::uint32_t combine_keys(std::uint32_t a, std::uint32_t b) {
  return mix_bits((static_cast<std::uint64_t>(a) << 32) | b);
}

constexpr std::uint32_t reverse_bits(std::uint32_t x) {
  x = ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
  x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
  x = ((x >> 4) & 0x0F0F0F0Fu) | ((x & 0x0F0F0F0Fu) << 4);
  x = ((x >> 8) & 0x00FF00FFu) | ((x & 0x00FF00FFu) << 8);
  return (x >> 16) | (x << 16);
}

/// Owen scrambling of a bit-reversed value: each bit is flipped by a hash of the bits below it (Laine & Karras 2011).
constexpr std::uint32_t scramble_reversed(std::uint32_t x, std::uint32_t key) {
  x += key;
  x ^= x * 0x6C50B47Cu;
  x ^= x * 0xB82F1E52u;
  x ^= x * 0xC7AFE638u;
  x ^= x * 0x8D22F6E6u;
  return x;
}
constexpr std::uint32_t nested_uniform_scramble(std::uint32_t x, std::uint32_t key) {
  return reverse_bits(scramble_reversed(reverse_bits(x), key));
}

/// Second Sobol coordinate (primitive polynomial x + 1) of an index, as 32-bit fixed point. The first is
/// reverse_bits().
std::uint32_t sobol_second(std::uint32_t index);

/// The points of one pixel or one receiver.
class SampleStream {
public:
  SampleStream(std::uint32_t key, std::uint32_t index) : key_(key), index_(index) {}
  /// Point in [0, 1)^2 number `index` of the sequence that belongs to `pair`.
  glm::vec2 point(std::uint32_t pair) const;

private:
  std::uint32_t key_, index_;
};

} // namespace daylit
