#pragma once

// Fall-off of a lens towards the edge of the picture.

#include <vector>

#include "scene/core/result.h"
#include "scene/image/rgb_image.h"
#include "scene/lens/fall_off.h"

namespace daylit::calibration {

/// Light seen at an angle from the axis; `source`: samples of one source (a picture of a flat field) have one level
/// that is not known.
struct FallOffSample {
  double theta = 0.0; ///< radians
  double value = 0.0;
  std::size_t source = 0;
  /// Of a ring: the relative deviation (rms) of the light of opposite parts together, where a slope cancels.
  double uneven = 0.0;
};

struct FallOffFit {
  FallOff fall_off;
  double rms = 0.0;                    ///< relative, of the samples
  double held_out = 0.0;               ///< the same of samples that had no part in the fit
  double reach = 0.0;                  ///< largest angle of a sample, radians
  double at_reach = 1.0;               ///< relative sensitivity there
  double uneven = 0.0;                 ///< of the most uneven ring
  std::vector<double> theta, relative; ///< samples beside the level of their source
};

/// Medians over rings of equal angle of a picture of an evenly lit surface, all of it unsaturated. A light that rises
/// along a line cancels on a ring that lies whole in the picture; other rings are left out.
std::vector<FallOffSample> ring_samples(const RgbImage& picture, const LensModel& lens, std::size_t source);

/// Least squares for 1 + a1 t^2 + a2 t^4 + a3 t^6. Error value_invalid: fewer than six samples, or they do not reach
/// from near the axis (20 degrees) to 40 degrees.
Result<FallOffFit> fit_fall_off(const std::vector<FallOffSample>& samples);

} // namespace daylit::calibration
