#pragma once

// The pose of a camera from frame to frame: jitter taken out, short losses bridged, and said plainly when it is lost.

#include <optional>

#include <glm/gtc/quaternion.hpp>
#include <glm/mat4x4.hpp>

#include "capture/markers/marker_pose.h"

namespace daylit {

enum class TrackingState {
  measured,  ///< from this frame's markers
  ambiguous, ///< the markers fit two poses equally well: the last sure pose is kept
  predicted, ///< no markers: the last motion carried on
  lost,      ///< none for too long, or none yet; the pose is the last one known and must not be drawn with
};

struct TrackedPose {
  TrackingState state = TrackingState::lost;
  glm::dmat4 world_from_camera{1.0};
  double age_s = 0; ///< since the last sure measurement
  bool usable() const { return state != TrackingState::lost; }
};

struct PoseFilterSettings {
  double smoothing_s = 0.12; ///< time constant of the low pass while the camera stands
  double largest_lag_px =
      0.25;                ///< the filtered pose puts the board's corners at most so far (rms) from the measured one
  double predict_s = 0.25; ///< losses up to this long are bridged
  double hold_s = 2.0;     ///< an ambiguous pose is held no longer than this
};

/// A low pass on the board's position and attitude before the camera, weaker the further it would lag: standing still
/// the noise is averaged, moving the lag stays below a fraction of a pixel on the board. Times must not fall.
class PoseFilter {
public:
  PoseFilter(const LensModel& lens, const BoardLayout& board, const glm::dmat4& world_from_board,
             const PoseFilterSettings& settings = {});

  /// `pose`: as marker_pose() gave it with this lens and board; nothing: no marker was found. Seconds of the frame.
  TrackedPose update(const MarkerPose* pose, double time_s);
  TrackedPose update(const MarkerPose& pose, double time_s) { return update(&pose, time_s); }

private:
  /// Board before the camera.
  struct Placement {
    glm::dvec3 position{0.0};
    glm::dquat attitude{1.0, 0.0, 0.0, 0.0};
  };
  struct Motion {
    glm::dvec3 velocity{0.0}; ///< metres per second
    glm::dvec3 spin{0.0};     ///< rotation vector per second
  };

  TrackedPose tracked(TrackingState state, const Placement& placement, double age_s) const;
  TrackedPose without_measurement(TrackingState state, double time_s) const;
  Placement smoothed(const Placement& measured, double dt) const;
  Placement moved_on(double dt) const;
  double distance_px(const Placement& a, const Placement& b) const;

  LensModel lens_;
  BoardLayout board_;
  glm::dmat4 world_from_board_;
  PoseFilterSettings settings_;
  std::optional<Placement> last_;
  std::optional<Motion> motion_;
  double last_time_s_ = 0;
};

} // namespace daylit
