#pragma once

// A loop over all cores that reports how far it is and can be stopped.

#include <atomic>
#include <string>

#include "scene/core/parallel.h"
#include "scene/core/program.h"

namespace daylit {

/// body(i) for i in [0, count), in any order; progress(stage, fraction done) after every `step` of them. Error:
/// interrupted, when progress() said false; then not all have been done.
template <class Body>
Result<void> parallel_stage(const std::string& stage, std::size_t count, std::size_t step, const Progress& progress,
                            const Body& body) {
  std::atomic<std::size_t> done{0};
  std::atomic<bool> stop{false};
  parallel_for(std::size_t{0}, count, [&](std::size_t i) {
    if (stop)
      return;
    body(i);
    const std::size_t now = ++done;
    if (now % step == 0 && !progress(stage, static_cast<double>(now) / static_cast<double>(count)))
      stop = true;
  });
  if (stop)
    return interrupted_error(stage);
  return {};
}

} // namespace daylit
