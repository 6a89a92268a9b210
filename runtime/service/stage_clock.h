#pragma once

#include <chrono>

#include "runtime/service/session.h"

namespace daylit {

/// Writes the wall-clock time of each stage of a frame into its report.
class StageClock {
public:
  explicit StageClock(FrameReport& report) : report_(report), start_(now()), last_(start_) {}
  void end(const char* stage) {
    const auto t = now();
    report_.stage_ms.emplace_back(stage, milliseconds(t - last_));
    report_.total_ms = milliseconds(t - start_);
    last_ = t;
  }

private:
  using Clock = std::chrono::steady_clock;
  static Clock::time_point now() { return Clock::now(); }
  static double milliseconds(Clock::duration d) { return std::chrono::duration<double, std::milli>(d).count(); }
  FrameReport& report_;
  Clock::time_point start_, last_;
};

} // namespace daylit
