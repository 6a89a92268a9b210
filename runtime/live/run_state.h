#pragma once

// How a live run stands, in words.

#include <string>

#include "capture/hdr/lost_sun.h"
#include "capture/markers/pose_filter.h"
#include "runtime/live/camera_watch.h"

namespace daylit {

struct RunState {
  const CameraReport &sky, &interior;
  bool wanted = false;                              ///< somebody looks
  double sky_age_s = -1;                            ///< of the sky in use; negative: there is none
  const SkyBalance* balance = nullptr;              ///< of the sky in use; null: there is none
  TrackingState tracking = TrackingState::measured; ///< of the last picture
};

/// The first thing that matters to whoever looks after it: "drawing" where all is well.
std::string in_words(const RunState& state);

} // namespace daylit
