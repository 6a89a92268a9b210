#pragma once

#include <algorithm>
#include <chrono>

#include "runtime/session/session.h"

namespace daylit {

/// Adds the wall-clock time of each stage of a frame to its report.
class StageClock {
public:
  explicit StageClock(FrameReport& report) : report_(report), last_(now()) {}
  void end(const char* stage) {
    const auto t = now();
    const double ms = milliseconds(t - last_);
    const auto same = std::find_if(report_.stage_ms.begin(), report_.stage_ms.end(),
                                   [&](const auto& known) { return known.first == stage; });
    if (same == report_.stage_ms.end())
      report_.stage_ms.emplace_back(stage, ms);
    else
      same->second += ms;
    report_.total_ms += ms;
    last_ = t;
  }

private:
  using Clock = std::chrono::steady_clock;
  static Clock::time_point now() { return Clock::now(); }
  static double milliseconds(Clock::duration d) { return std::chrono::duration<double, std::milli>(d).count(); }
  FrameReport& report_;
  Clock::time_point last_;
};

} // namespace daylit
