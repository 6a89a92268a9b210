#pragma once

// The second step of a compact basis: from the amplitudes of a brick's components to the numbers of its probes.

#include <array>
#include <cstdint>
#include <span>

#include "scene/volume/compact_basis.h"

namespace daylit::detail {

/// result[probe][lm][c] = sum over components of factor * amplitude[c * rank + component].
void sum_brick(const CompactFactors::Brick& brick, const std::int8_t* probe_factor, std::span<const float> amplitude,
               std::span<std::array<Rgb, 9>> result);

} // namespace daylit::detail
