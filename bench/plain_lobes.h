#pragma once

// The plain sum of algorithm 4.1 in float, as fast as it goes without leaving anything out: what the lobe bounds save
// is measured against it.

#include <cstddef>
#include <span>
#include <vector>

#include "bench/angular_map.h"

namespace daylit::bench {

/// Exponents that share one pass: each power from the one before.
inline constexpr double kEightExponents[8] = {1, 10, 40, 80, 160, 320, 640, 1280};

/// sum L w cos^s / sum w cos^s at some pixels for kEightExponents[first ...], first 0 or 2: [output][exponent][3]. One
/// thread.
std::vector<float> plain_lobes(const AngularMap& map, std::span<const std::size_t> outputs, std::size_t first);

} // namespace daylit::bench
