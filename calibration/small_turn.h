#pragma once

// Rotation vectors: axis times angle, radians.

#include <cmath>

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>

namespace daylit::calibration {

/// exp of a rotation vector.
inline glm::dmat3 turn_by(const glm::dvec3& v) {
  const double angle = glm::length(v);
  return angle > 0 ? glm::mat3_cast(glm::angleAxis(angle, v / angle)) : glm::dmat3(1.0);
}

/// The rotation vector of a turn by less than 180 degrees, from its antisymmetric part.
inline glm::dvec3 turn_vector(const glm::dmat3& r) {
  const glm::dvec3 v = 0.5 * glm::dvec3(r[1][2] - r[2][1], r[2][0] - r[0][2], r[0][1] - r[1][0]);
  const double sine = glm::length(v), cosine = 0.5 * (r[0][0] + r[1][1] + r[2][2] - 1.0);
  return sine > 1e-12 ? std::atan2(sine, cosine) / sine * v : v;
}

} // namespace daylit::calibration
