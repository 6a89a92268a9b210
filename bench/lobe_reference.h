#pragma once

// Slow references of the lobe maps.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "bench/angular_map.h"

namespace daylit::bench {

/// The exponents of the thesis (Unterguggenberger 2016, table 6.1).
inline constexpr std::array<double, 15> kExponents = {1,   2,   10,   20,   40,   80,    160,  240,
                                                      320, 640, 1280, 2560, 5120, 10240, 20480};

/// One pixel or texel, by chance, of every cell x cell block of a map of `side` x `side`.
std::vector<std::size_t> one_per_cell(const AngularMap& map, int side, int cell, std::uint64_t seed);

/// Direct summation (algorithm 4.1): sum L w cos^s / sum w cos^s over all pixels, in double. [output][exponent][3].
std::vector<double> direct_lobes(const AngularMap& map, std::span<const std::size_t> outputs);

/// The thesis' method as a GPU with 32-bit floats runs it (algorithms 4.4-4.7): factorials, NaN taken as 0, no
/// division by the sum of weights. `order` bands. [output][exponent][3].
std::vector<double> factorial_lobes(const AngularMap& map, std::span<const std::size_t> outputs, int order);

} // namespace daylit::bench
