#pragma once

#include <cstdint>

namespace daylit::detail {

/// binary32 to binary16, to nearest even; overflow to infinity. And back, exact.
std::uint16_t to_half(float value);
float from_half(std::uint16_t half);

} // namespace daylit::detail
