#pragma once

// The clocks of the system, in seconds; only differences mean something.

#include <time.h>

namespace daylit {

inline double clock_seconds(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Time that passes, whatever the machine does.
inline double wall_seconds() { return clock_seconds(CLOCK_MONOTONIC); }
/// Processor time of all threads of this process: other load on the machine does not count.
inline double process_seconds() { return clock_seconds(CLOCK_PROCESS_CPUTIME_ID); }
/// Processor time of the calling thread.
inline double thread_seconds() { return clock_seconds(CLOCK_THREAD_CPUTIME_ID); }

} // namespace daylit
