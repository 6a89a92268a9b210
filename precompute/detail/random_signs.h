#pragma once

// Signs of a fixed sequence: the random columns of sketches and of estimates of norms.

#include <cstdint>
#include <vector>

#include "radiosity/detail/sampling.h"

namespace daylit::precompute::detail {

/// Number `index` of a sequence of +1 and -1.
inline float random_sign(std::uint64_t index) { return radiosity::mix_bits(index * 2 + 1) >> 63 != 0 ? 1.0f : -1.0f; }

inline std::vector<float> random_signs(std::uint64_t seed, std::size_t count) {
  std::vector<float> s(count);
  for (std::size_t k = 0; k < s.size(); ++k)
    s[k] = random_sign(seed * 0x100000000ull + k);
  return s;
}

} // namespace daylit::precompute::detail
