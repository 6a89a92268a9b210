#pragma once

// Where the interior camera stands, frame by frame.

#include <optional>

#include "capture/markers/marker_tracker.h"
#include "capture/markers/pose_filter.h"
#include "runtime/input/photograph.h"
#include "scene/config/config.h"
#include "scene/core/result.h"
#include "scene/lens/lens.h"

namespace daylit {

/// As [pose] gives it, or followed by the board of [marker].
class CameraPose {
public:
  /// `lens`: for the size of the frames. Errors: of board_of(); neither [pose] nor [marker].
  static Result<CameraPose> make(const RunConfig& config, const LensModel& lens);
  /// Seconds of any clock that does not go back. Error: of the search, not that there is no marker.
  Result<TrackedPose> at(const Photograph& photo, double time_s);

private:
  CameraPose() = default;
  std::optional<glm::dmat4> given_;
  std::string response_;
  glm::dmat4 world_from_board_{1.0};
  LensModel lens_;
  float white_ = 0; ///< around the markers of the frame before: what the next is exposed for
  std::optional<MarkerTracker> tracker_;
  std::optional<PoseFilter> filter_;
};

/// "measured", "ambiguous", "predicted", "lost".
const char* name_of(TrackingState state);

} // namespace daylit
