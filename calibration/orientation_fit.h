#pragma once

// How a camera is turned, from directions that are known in the camera and in the world.

#include <string>
#include <vector>

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include "scene/core/result.h"

namespace daylit::calibration {

/// A point or a sun that the camera sees: unit vectors.
struct Sighting {
  std::string name;
  glm::dvec3 camera{0.0}; ///< camera frame: x right, y down, z forward
  glm::dvec3 world{0.0};
};

struct OrientationFit {
  glm::dmat3 world_from_camera{1.0};
  std::vector<bool> used;        ///< of each sighting
  std::vector<double> error_deg; ///< of each sighting
  double rms_deg = 0.0;          ///< over those used
  double spread_deg = 0.0;       ///< largest angle between two that are used
  /// Standard deviation of the turn about the worst axis, degrees, from the scatter of those used (at least
  /// kLeastScatter_deg each).
  double sigma_deg = 0.0;
  /// The same when each one that is used is left out in turn: the largest change of the turn.
  double held_out_deg = 0.0;
};

inline constexpr double kLeastScatter_deg = 0.02;

/// The rotation that most sightings agree on within `tolerance_deg`, then the least squares one of these. Error
/// value_invalid: fewer than `fewest` (at least 2) agree, or all of these lie in one direction.
Result<OrientationFit> fit_orientation(const std::vector<Sighting>& sightings, double tolerance_deg,
                                       std::size_t fewest);

/// Angle of the rotation between two orientations, degrees.
double turn_between(const glm::dmat3& a, const glm::dmat3& b);

} // namespace daylit::calibration
