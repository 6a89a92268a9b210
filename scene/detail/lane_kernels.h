#pragma once

// A tall matrix of half floats times three vectors: the sky seen by a few dozen components.

#include <cstddef>
#include <cstdint>

namespace daylit::detail {

constexpr std::size_t kLanes = 16;     ///< components come in groups of these
constexpr std::size_t kMostGroups = 4; ///< of lanes

/// sum[c * groups * 16 + lane] += sum_k table[k][lane] * rgb[3 k + c] for `count` rows of 16 * groups half floats.
using AddLanes = void (*)(const std::uint16_t* table, const float* rgb, std::size_t count, std::size_t groups,
                          float* sum);
AddLanes add_lanes_kernel();
/// The slow twin.
void add_lanes_plain(const std::uint16_t* table, const float* rgb, std::size_t count, std::size_t groups, float* sum);

} // namespace daylit::detail
