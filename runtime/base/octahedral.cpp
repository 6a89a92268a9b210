#include "runtime/base/octahedral.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

namespace daylit {

/// Clarberg 2008, eq. 5 to 9, in the form without branches (also Pharr, Jakob & Humphreys, "Physically Based
/// Rendering", 4th edition, sect. 3.8.3): with d = 1 - (|u| + |v|) and r = 1 - |d|,
///   phi = pi/4 ((|v| - |u|) / r + 1),  |z| = 1 - r^2,  sin(theta) = r sqrt(2 - r^2).
/// dz dphi = 2 r dr (pi/4) d((|v| - |u|)/r) = pi/2 du dv: the area is kept.
glm::dvec3 octahedral_direction(const glm::dvec2& square) {
  const double u = std::abs(square.x), v = std::abs(square.y), d = 1.0 - (u + v), r = 1.0 - std::abs(d);
  const double phi = r == 0.0 ? 0.0 : std::numbers::pi / 4.0 * ((v - u) / r + 1.0);
  const double sine = r * std::sqrt(2.0 - r * r);
  return {std::copysign(sine * std::cos(phi), square.x), std::copysign(sine * std::sin(phi), square.y),
          std::copysign(1.0 - r * r, d)};
}

/// 1 - |z| = (x^2 + y^2) / (1 + |z|), without cancellation near the poles.
glm::dvec2 octahedral_point(const glm::dvec3& direction) {
  const glm::dvec3 w = glm::normalize(direction);
  const double r = std::min(1.0, std::sqrt((w.x * w.x + w.y * w.y) / (1.0 + std::abs(w.z))));
  const double across = r * std::atan2(std::abs(w.y), std::abs(w.x)) * 2.0 / std::numbers::pi;
  const glm::dvec2 north(r - across, across), p = w.z < 0.0 ? glm::dvec2(1.0 - north.y, 1.0 - north.x) : north;
  return {std::copysign(p.x, w.x), std::copysign(p.y, w.y)};
}

} // namespace daylit
