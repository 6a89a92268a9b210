#pragma once

#include <algorithm>

#include <glm/geometric.hpp>

namespace daylit {

/// From p to the nearest point between a and b, which may be one point; vectors of doubles.
template <class Vector>
double distance_to_segment(const Vector& p, const Vector& a, const Vector& b) {
  const Vector along = b - a;
  const double length2 = glm::dot(along, along);
  const double t = length2 > 0.0 ? std::clamp(glm::dot(p - a, along) / length2, 0.0, 1.0) : 0.0;
  return glm::distance(p, a + t * along);
}

} // namespace daylit
