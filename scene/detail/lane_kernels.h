#pragma once

// A tall matrix of bytes times three vectors: the sky seen by a few dozen components.

#include <cstddef>
#include <cstdint>

namespace daylit::detail {

constexpr std::size_t kLanes = 16;       ///< components come in groups of these
constexpr std::size_t kMostGroups = 4;   ///< of lanes
constexpr std::size_t kLaneRegions = 32; ///< most in one call: their integer sums are exact in 32 bits
constexpr std::int32_t kLaneMost = 8191; ///< largest integer of a colour; the table holds at most 127

/// sum[c * groups * 16 + lane] += sum_k table[k / 2][lane][k % 2] * rgb[3 k + c] for `count` regions, in pairs of
/// 16 * groups lanes; the table of an odd number ends with zeros. The colours are rounded to kLaneMost steps of their
/// largest; integers are the same in every version.
using AddLanes = void (*)(const std::int8_t* table, const float* rgb, std::size_t count, std::size_t groups,
                          float* sum);
AddLanes add_lanes_kernel();
/// The slow twin.
void add_lanes_plain(const std::int8_t* table, const float* rgb, std::size_t count, std::size_t groups, float* sum);

} // namespace daylit::detail
