#pragma once

// A recorded sequence of both cameras, drawn frame by frame.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "capture/markers/pose_filter.h"
#include "runtime/session/choose_renderer.h"
#include "scene/config/config.h"
#include "scene/core/result.h"

namespace daylit {

struct ReplayOptions {
  std::filesystem::path folder; ///< holds sky/ and interior/, recordings of daylit-run record
  int most_frames = 0;          ///< 0: all
  Backend backend = Backend::automatic;
};

struct ReplayedFrame {
  std::size_t index = 0; ///< in the interior camera's recording
  std::uint64_t interior_id = 0, sky_id = 0;
  double sky_age_s = 0; ///< how much older than the interior frame the sky is; negative before the first sky
  TrackingState tracking = TrackingState::measured;
  bool drawn = false; ///< without a pose the photograph stays as it is
  double total_ms = 0;
};

/// For each interior frame in order: the newest sky frame that was there by then, the pose of [pose] or of the marker,
/// and the pictures of [output] with the frame's index in their names (picture.png: picture-00000.png). The interior
/// camera's frames are [interior] image, the sky camera's are [sky] image: its code values are linear, 1 = the largest,
/// per millisecond of exposure where the frames state one. `report` is called after each frame. The same recording
/// gives the same bits. Errors: a recording is missing or damaged, and all of a single picture.
Result<void> replay_recording(const RunConfig& config, const ReplayOptions& options,
                              const std::function<void(const ReplayedFrame&)>& report);

} // namespace daylit
