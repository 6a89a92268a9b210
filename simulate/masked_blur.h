#pragma once

// Smoothing of what noise spoils, within a part of a picture.

#include <vector>

namespace daylit {

/// One number per pixel, row-major.
using Plane = std::vector<double>;

constexpr double kBlur_px = 1.5; ///< standard deviation

/// G * (value x mask) / G * mask with a Gaussian of kBlur_px, cut at four deviations: what the mask leaves out takes no
/// part. `mask`: 0..1.
Plane blur_within(Plane value, const Plane& mask, int width, int height);
/// Standard errors of what blur_within() makes of values with these, each on its own: sqrt(G^2 * (s x mask)^2) / G *
/// mask.
Plane blurred_error(Plane standard_error, const Plane& mask, int width, int height);

} // namespace daylit
