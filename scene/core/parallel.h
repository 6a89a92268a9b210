#pragma once

// Loops over all cores: oneTBB, and the same loops on plain threads where ThreadSanitizer watches. It does not see how
// the library, which is not instrumented, hands work from thread to thread, and would report every result.

#include <cstddef>

#include <tbb/blocked_range.h>
#if defined(__SANITIZE_THREAD__)
#include <algorithm>
#include <atomic>
#include <thread>
#include <utility>
#include <vector>

#include <tbb/global_control.h>
#else
#include <tbb/parallel_for.h>
#endif

namespace daylit {

#if defined(__SANITIZE_THREAD__)
namespace detail {
inline thread_local bool in_parallel_loop = false; ///< nested loops run on the thread that meets them
}

/// body(part) for parts of the range, at least a grain each, in any order and on any thread; returns when all are done.
template <class Index, class Body>
void parallel_for(const tbb::blocked_range<Index>& range, const Body& body) {
  const std::size_t parts = (range.size() + range.grainsize() - 1) / range.grainsize();
  const std::size_t allowed = tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
  const std::size_t threads = detail::in_parallel_loop ? 1 : std::min({parts, allowed, std::size_t{4}});
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    const bool outer = std::exchange(detail::in_parallel_loop, true);
    const auto grain = static_cast<Index>(range.grainsize());
    for (std::size_t part = next++; part < parts; part = next++) {
      const Index first = range.begin() + static_cast<Index>(part) * grain;
      body(tbb::blocked_range<Index>(first, std::min<Index>(range.end(), first + grain)));
    }
    detail::in_parallel_loop = outer;
  };
  std::vector<std::jthread> team;
  for (std::size_t t = 1; t < threads; ++t)
    team.emplace_back(work);
  work();
}

/// body(i) for i in [first, last), as above.
template <class Index, class Body>
void parallel_for(Index first, Index last, const Body& body) {
  if (first < last)
    parallel_for(tbb::blocked_range<Index>(first, last), [&](const auto& range) {
      for (Index i = range.begin(); i != range.end(); ++i)
        body(i);
    });
}
#else
using tbb::parallel_for;
#endif

} // namespace daylit
