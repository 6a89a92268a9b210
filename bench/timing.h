#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <vector>

#include "scene/core/seconds.h"

namespace daylit::bench {

/// Seconds of one call.
template <class Body>
double time_once(Body&& body) {
  const double start = thread_seconds();
  body();
  return thread_seconds() - start;
}

/// Elapsed seconds of one call that uses several threads.
template <class Body>
double wall_time_once(Body&& body) {
  timespec start{}, end{};
  clock_gettime(CLOCK_MONOTONIC, &start);
  body();
  clock_gettime(CLOCK_MONOTONIC, &end);
  return double(end.tv_sec - start.tv_sec) + 1e-9 * double(end.tv_nsec - start.tv_nsec);
}

/// Reads every byte in order: what no program that needs the bytes can undercut.
inline void read_plainly(std::span<const std::byte> bytes) {
  std::array<std::uint64_t, 32> sum{}; // enough for the widest vectors, four side by side
  const std::byte* from = bytes.data();
  for (std::size_t k = 0; k + sizeof(sum) <= bytes.size(); k += sizeof(sum)) {
    std::array<std::uint64_t, 32> part;
    std::memcpy(&part, from + k, sizeof(part));
    for (std::size_t i = 0; i < sum.size(); ++i)
      sum[i] += part[i];
  }
  volatile std::uint64_t sink = 0;
  for (const std::uint64_t s : sum)
    sink = sink + s;
}

/// Minimum over repetitions of each body, the bodies taking turns so that drift of the machine meets all alike.
template <class... Bodies>
std::vector<double> alternate(int repetitions, Bodies&&... bodies) {
  std::vector<double> best(sizeof...(bodies), std::numeric_limits<double>::infinity());
  for (int r = 0; r < repetitions; ++r) {
    std::size_t k = 0;
    ((best[k] = std::min(best[k], time_once(bodies)), ++k), ...);
  }
  return best;
}

/// 0 of no values.
inline double median(std::vector<double> v) {
  if (v.empty())
    return 0.0;
  const auto middle = v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2);
  std::nth_element(v.begin(), middle, v.end());
  return *middle;
}

} // namespace daylit::bench
