#pragma once

// What a live run says about itself.

#include <chrono>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "runtime/live/camera_watch.h"
#include "runtime/live/frame_drawer.h"
#include "runtime/live/recorder.h"

namespace daylit {

struct LiveReport {
  double uptime_s = 0;
  std::string state;                      ///< one word or a few: "drawing", "idle", "no sky yet", "marker lost", ...
  std::uint64_t drawn = 0, untouched = 0; ///< pictures; untouched: without a pose or a sky, the photograph as it is
  double pictures_per_s = 0;              ///< over the last five seconds
  double latency_median_ms = 0, latency_99_ms = 0; ///< from the camera's time stamp to the picture, last 1000 pictures
  double latency_sum_s = 0;                        ///< over all pictures
  double sky_age_s = -1;                           ///< of the sky in use; negative: there is none
  double picture_age_s = -1;                       ///< since the last picture was drawn; negative: none was
  DrawnFrame last;                                 ///< of the last picture
  FrameReport stages;                              ///< of the last picture that was drawn
  int viewers = 0;
  CameraReport sky, interior;
  std::optional<RecorderReport> sky_recording, interior_recording;
  std::uint64_t reloads = 0, reloads_refused = 0;
  std::string last_reload; ///< why the last one was refused; empty: it was not
};

/// Written by the run, read by anybody; no lock is held longer than it takes to copy it.
class LiveStatus {
public:
  /// A picture was published, so long after its photograph was taken.
  void picture(const DrawnFrame& frame, const FrameReport& stages, double latency_s);
  void reloaded(const std::string& refused); ///< empty: it was not refused
  /// What the run knows besides; called every tenth of a second at least. True: the state is another one;
  /// a number alone that goes on, a count or an age, makes none.
  bool set(const std::string& state, double sky_age_s, int viewers, const CameraReport& sky,
           const CameraReport& interior, const std::optional<RecorderReport>& sky_recording,
           const std::optional<RecorderReport>& interior_recording);
  LiveReport report() const;
  /// Seconds since the run last called set().
  double silence_s() const;

private:
  using Clock = std::chrono::steady_clock;
  mutable std::mutex mutex_; ///< of all below
  LiveReport report_;
  Clock::time_point start_ = Clock::now(), last_set_ = Clock::now(), last_picture_{};
  std::deque<Clock::time_point> times_; ///< of the pictures of the last five seconds
  std::deque<double> latencies_s_;      ///< of the last pictures
};

std::string to_json(const LiveReport& report);
std::string to_json(const DrawnFrame& frame);
/// Text of the Prometheus exposition format, version 0.0.4.
std::string to_prometheus(const LiveReport& report);

} // namespace daylit
