#pragma once

// The orientations of all pictures together, and their true exposures.

#include <span>
#include <vector>

#include "calibration/rotation_match.h"

namespace daylit::calibration {

struct AlignedPictures {
  std::vector<bool> aligned;  ///< false: no feature in common with another picture; it stays where it was said to be
  double rms_deg = 0.0;       ///< of the matches
  double moved_rms_deg = 0.0; ///< of the pictures, from their rough orientations
};

/// Turns the pictures so that matched directions meet: least squares with Huber's weights, Gauss-Newton (rotation-only
/// bundle adjustment, Brown & Lowe 2007, section 4, with known focal lengths). Rough orientations count as measured to
/// `sigma_rough` radians each: they keep the whole from turning away.
AlignedPictures align_pictures(std::vector<HandHeldPicture>& pictures, std::span<const PictureMatch> matches,
                               double sigma_rough);

struct RefinedExposures {
  std::vector<double> measured_over_stated; ///< of each picture
  double disagreement = 0.0;                ///< pictures that overlap, afterwards: rms of the medians of their ratios
  std::size_t pairs = 0;
};

/// Where pictures overlap and both are well exposed they see the same radiance: multiplies the exposures so that they
/// do, in least squares over the medians of the pairs; the stated ones count as right to kStatedExposure each.
/// Error: interrupted.
Result<RefinedExposures> refine_exposures(std::vector<HandHeldPicture>& pictures, const Progress& progress);

inline constexpr double kStatedExposure = 0.1; ///< relative deviation

/// Directions spread evenly over the sphere (Gonzalez 2010).
std::vector<glm::dvec3> even_directions(std::size_t count);

} // namespace daylit::calibration
