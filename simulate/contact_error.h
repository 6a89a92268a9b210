#pragma once

// How far a composited picture is from the truth where the object touches the room: people look there first.

#include <cstddef>

#include "scene/image/rgb_image.h"

namespace daylit {

/// Luminance over the contact band: pixels that show nothing of the object and lie within kContactBand_px of one that
/// does. Both pictures are smoothed over the room's pixels by blur_within(), which noise needs.
struct ContactError {
  std::size_t pixels = 0;    ///< 0: no such pixel, or all black; the numbers below say nothing
  double relative_rms = 0.0; ///< of the difference / mean of the truth there
  double bias = 0.0;         ///< mean of the difference / mean of the truth there
  /// Of single pixels: largest and smallest difference / truth, or a quarter of the band's mean where that is more.
  double brightest = 0.0, darkest = 0.0;
};

constexpr int kContactBand_px = 4;

/// `coverage`: fraction of each pixel that the object covers in the truth. All of one size.
ContactError measure_contact(const RgbImage& result, const RgbImage& truth, const RgbImage& coverage);

} // namespace daylit
