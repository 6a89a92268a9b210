#include "simulate/low_discrepancy.h"

#include <array>

namespace daylit {

namespace {

using ByteTables = std::array<std::array<std::uint32_t, 256>, 4>;

constexpr ByteTables make_second_dimension() {
  std::array<std::uint32_t, 32> direction{};
  direction[0] = 0x80000000u;
  for (std::size_t k = 1; k < 32; ++k)
    direction[k] = direction[k - 1] ^ (direction[k - 1] >> 1);
  ByteTables tables{};
  for (std::size_t byte = 0; byte < 4; ++byte)
    for (std::size_t value = 0; value < 256; ++value)
      for (std::size_t bit = 0; bit < 8; ++bit)
        if ((value >> bit) & 1u)
          tables[byte][value] ^= direction[8 * byte + bit];
  return tables;
}

constexpr ByteTables kSecondDimension = make_second_dimension();

/// 24 bits: the largest value is below 1 after rounding to float.
float unit_interval(std::uint32_t bits) { return static_cast<float>(bits >> 8) * 0x1p-24f; }

} // namespace

std::uint32_t sobol_second(std::uint32_t index) {
  return kSecondDimension[0][index & 255u] ^ kSecondDimension[1][(index >> 8) & 255u] ^
         kSecondDimension[2][(index >> 16) & 255u] ^ kSecondDimension[3][index >> 24];
}

glm::vec2 SampleStream::point(std::uint32_t pair) const {
  const std::uint32_t key = combine_keys(key_, pair);
  const std::uint32_t shuffled = nested_uniform_scramble(index_, key);
  // The first coordinate is reverse_bits(shuffled); scrambling reverses once more, so both reversals cancel.
  const std::uint32_t x = reverse_bits(scramble_reversed(shuffled, mix_bits(key)));
  const std::uint32_t y = nested_uniform_scramble(sobol_second(shuffled), mix_bits(key ^ 0xA511E9B3u));
  return {unit_interval(x), unit_interval(y)};
}

} // namespace daylit
