#pragma once

// Sums of a picture's parts that threads take: one for each region of each part, those of a region side by side, so
// that the result does not depend on which thread takes which part.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace daylit::detail {

/// `each(visit)` calls visit(part, region) for everything that is summed, part after part, the same each time; `region`
/// becomes the number of its sum. Returns the first sum of each region, and the end.
template <class Each>
std::vector<std::uint32_t> number_slots(std::size_t regions, const Each& each) {
  std::vector<std::uint32_t> first(regions + 1, 0);
  std::vector<std::size_t> seen_in(regions, 0); // parts, counted from 1
  each([&](std::size_t part, std::uint32_t region) {
    first[region + 1] += seen_in[region] != part + 1 ? 1 : 0;
    seen_in[region] = part + 1;
  });
  for (std::size_t r = 0; r < regions; ++r)
    first[r + 1] += first[r];
  std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
  std::ranges::fill(seen_in, std::size_t{0});
  each([&](std::size_t part, std::uint32_t& region) {
    const std::uint32_t r = region;
    next[r] += seen_in[r] != part + 1 ? 1 : 0;
    seen_in[r] = part + 1;
    region = next[r] - 1;
  });
  return first;
}

} // namespace daylit::detail
