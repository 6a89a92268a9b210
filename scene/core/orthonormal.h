#pragma once

#include <cmath>

#include <glm/vec3.hpp>

namespace daylit {

/// Right-handed basis u, v, w around a unit vector w; continuous except at w = (0, 0, -1)
/// (Duff et al. 2017, "Building an Orthonormal Basis, Revisited").
struct OrthonormalBasis {
  glm::dvec3 u, v;
  explicit OrthonormalBasis(const glm::dvec3& w) {
    const double sign = std::copysign(1.0, w.z), a = -1.0 / (sign + w.z), b = w.x * w.y * a;
    u = {1.0 + sign * w.x * w.x * a, sign * b, -sign * w.x};
    v = {b, sign + w.y * w.y * a, -w.y};
  }
};

} // namespace daylit
