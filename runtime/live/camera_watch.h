#pragma once

// What is known about a camera of a live run, and which of its frames are used.

#include <chrono>
#include <cstdint>
#include <mutex>
#include <string>

#include "capture/frames/frame_source.h"

namespace daylit {

struct CameraReport {
  SourceReport source;
  std::uint64_t used = 0;    ///< frames that pictures were drawn from, or could have been
  std::uint64_t refused = 0; ///< whole, but of another size or format than expected
  std::uint64_t black = 0;   ///< of the sky: nothing in them, not used
  std::string blank;         ///< "black" or "white": the newest frame that was looked at is nothing else
  bool frozen = false;       ///< the frames that were looked at are the same, bit for bit, for five seconds
  double frame_age_s = -1;   ///< of the newest frame that was used; negative: none was
  std::string trouble;       ///< of the source, or why frames are refused; empty: none
  std::string likely_cause;  ///< of losses, and what to do; empty: nothing is lost
};

/// Written by the thread that takes a camera's frames, read by any.
class CameraWatch {
public:
  /// `black_is_unusable`: a sky without light is none. Size of the frames that are expected.
  CameraWatch(int width_px, int height_px, bool black_is_unusable,
              std::chrono::milliseconds frozen_after = std::chrono::seconds(5))
      : width_px_(width_px), height_px_(height_px), black_is_unusable_(black_is_unusable), frozen_after_(frozen_after) {
  }

  /// Whether the frame may be used; counts it if not.
  bool accept(const CameraFrame& frame);
  /// It turned out not to be usable, or it was used.
  void refuse(const std::string& why);
  void used(const CameraFrame& frame);
  CameraReport report(const SourceReport& source) const;

private:
  using Clock = std::chrono::steady_clock;
  const int width_px_, height_px_;
  const bool black_is_unusable_;
  const std::chrono::milliseconds frozen_after_;
  mutable std::mutex mutex_; ///< of all below
  std::uint64_t used_ = 0, refused_ = 0, black_ = 0;
  std::int64_t used_taken_ns_ = 0;
  std::string trouble_;
  std::uint64_t checksum_ = 0;
  Clock::time_point looked_{}, changed_{}; ///< when a frame was last looked at, and when it last was another picture
  bool seen_ = false;
  std::string blank_;
};

/// Seconds since a frame was taken.
double age_s(const CameraFrame& frame);

} // namespace daylit
