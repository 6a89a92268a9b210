#pragma once

// Orientations and exposures from the light itself: where pictures overlap they show the same radiance.

#include <vector>

#include "calibration/hand_held_list.h"

namespace daylit::calibration {

struct LightAgreement {
  std::vector<double> measured_over_stated; ///< exposure of each picture
  std::vector<double> sigma_deg;            ///< of each picture's turn about its least certain axis, the others held
  double disagreement = 0.0; ///< of pictures that overlap, relative: rms of the medians of their radiances' ratios
};

/// Turns the pictures and multiplies their exposures so that overlapping pictures agree: least squares over the
/// differences of log radiance with Huber's weights, Gauss-Newton, from blurred pictures to sharp ones (Lucas & Kanade
/// 1981; for panoramas Shum & Szeliski 2000, section 4). Unlike matched features it uses what has no corners: clouds, a
/// horizon, the glow around the sun. Pictures are held to their rough orientations within `sigma_rough` radians,
/// and to their stated exposures within kStatedExposure. Error: interrupted.
Result<LightAgreement> agree_in_light(std::vector<HandHeldPicture>& pictures, const std::vector<glm::dmat3>& rough,
                                      double sigma_rough, const Progress& progress);

inline constexpr double kStatedExposure = 0.1; ///< relative deviation

} // namespace daylit::calibration
