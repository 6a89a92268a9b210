#pragma once

// What can be wrong with photographs of a room besides its colours: pose, light outside, scale.

#include "calibration/material_fit.h"

namespace daylit::calibration {

/// The pose near the given one at which the computed picture is most like the photograph.
struct BetterPose {
  double turn_deg = 0, moved_m = 0; ///< from the given pose
  double before = 0, after = 0;     ///< mean |ln (measured / computed)|, each pixel at most kMostOff
  bool is_another() const;          ///< clearly better, and elsewhere
};
inline constexpr double kMostOff = 0.5;

/// By coordinate search over six degrees of freedom on some pixels; surfaces as bright as their patches, and the sky
/// through openings.
BetterPose search_pose(const MaterialView& view, const RoomTransport& transport, const MaterialFit& fit);

/// Median of measured over computed radiance of the sky seen through openings, all views; 0: hardly any is seen.
double window_level(const MaterialScene& scene, const RoomTransport& transport);

/// The view as the fit has it, `width_px` wide, for reports.
RgbImage computed_picture(const MaterialView& view, const RoomTransport& transport, const MaterialFit& fit,
                          int width_px);

} // namespace daylit::calibration
