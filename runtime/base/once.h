#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>

namespace daylit {

/// make() once per version, by the first thread that needs it; the others wait. `made`: the version that there is.
template <class Make>
void once(std::atomic<std::uint64_t>& made, std::uint64_t version, std::mutex& mutex, const Make& make) {
  if (made.load(std::memory_order_acquire) == version)
    return;
  const std::lock_guard lock(mutex);
  if (made.load(std::memory_order_relaxed) == version)
    return;
  make();
  made.store(version, std::memory_order_release);
}

} // namespace daylit
