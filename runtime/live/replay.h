#pragma once

// A recorded sequence of both cameras, drawn frame by frame.

#include <filesystem>
#include <functional>

#include "runtime/live/frame_drawer.h"
#include "scene/config/config.h"
#include "scene/core/result.h"

namespace daylit {

struct ReplayOptions {
  std::filesystem::path folder; ///< holds sky/ and interior/, recordings of daylit-run record
  int most_frames = 0;          ///< 0: all
  Backend backend = Backend::rays;
};

/// For each interior frame in order: the newest sky frame that was there by then (the first one before that, its age is
/// negative), the pose of [pose] or of the marker, and the pictures of [output] with the frame's index in their names
/// (picture.png: picture-00000.png). The interior camera's frames are [interior] image, the sky camera's are [sky]
/// image. `report` is called after each frame. The same recording gives the same bits. Errors: a recording is missing
/// or damaged, and all of a single picture.
Result<void> replay_recording(const RunConfig& config, const ReplayOptions& options,
                              const std::function<void(const DrawnFrame&)>& report);

} // namespace daylit
