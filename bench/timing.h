#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
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
  const double start = wall_seconds();
  body();
  return wall_seconds() - start;
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
