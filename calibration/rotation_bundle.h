#pragma once

// The orientations of all pictures together.

#include <span>
#include <vector>

#include "calibration/rotation_match.h"

namespace daylit::calibration {

/// Turns the pictures so that matched directions meet: least squares with Huber's weights, Gauss-Newton (rotation-only
/// bundle adjustment, Brown & Lowe 2007, section 4, with known focal lengths). Rough orientations count as measured to
/// `sigma_rough` radians each: they keep the whole from turning away. The result is how far matched directions are
/// apart then: rms, degrees.
double align_pictures(std::vector<HandHeldPicture>& pictures, std::span<const PictureMatch> matches,
                      double sigma_rough);

} // namespace daylit::calibration
