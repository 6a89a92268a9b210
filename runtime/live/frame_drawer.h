#pragma once

// One frame of the cameras drawn: what a recording and a live run have in common.

#include <cstdint>

#include "capture/hdr/lost_sun.h"
#include "capture/markers/pose_filter.h"
#include "runtime/input/photograph.h"
#include "runtime/session/session.h"

namespace daylit {

/// What was drawn, and from what.
struct DrawnFrame {
  std::size_t index = 0; ///< of the drawn frames; of a recording: in the interior camera's
  std::uint64_t interior_id = 0, sky_id = 0;
  double sky_age_s = 0; ///< how much older than the interior frame the sky is
  TrackingState tracking = TrackingState::measured;
  bool drawn = false; ///< without a pose, or without a sky, the photograph stays as it is
  double total_ms = 0;
  SkyBalance sky_balance; ///< of the sky it was drawn under
};

/// A photograph, where its camera stood, and the sky of that moment (null: there is none yet). Ids other than 0, equal
/// ones mean the same picture.
struct FrameToDraw {
  const Photograph& photo;
  std::uint64_t photo_id = 0;
  TrackedPose pose;
  const SkyImage* sky = nullptr;
  std::uint64_t sky_id = 0;
  const DepthPicture* depth = nullptr; ///< of the photograph's view; null: none
  bool can_be_drawn() const { return sky && pose.usable(); }
};

/// Session::render(); a renderer that lost its device is started again, once.
Result<const Frame*> render_again_once(Session& session, const FrameInput& input);

class FrameDrawer {
public:
  /// Loads room, objects and lens. Errors: of Session::open().
  static Result<FrameDrawer> open(const RunConfig& config, int width_px, int height_px, Backend backend,
                                  const Progress& progress);

  /// The composite is the drawer's own and holds until the next call: the photograph as it is where it cannot be drawn.
  Result<const Composite*> draw(const FrameToDraw& frame);
  /// Of the last frame that was drawn.
  const FrameReport& report() const { return report_; }
  const std::vector<std::string>& notes() const { return session_.notes(); }
  Session& session() { return session_; }

private:
  explicit FrameDrawer(Session session) : session_(std::move(session)) {}
  Session session_;
  Composite untouched_;
  FrameReport report_;
};

} // namespace daylit
