#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/vec2.hpp>
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

/// Density cos / pi about the unit vector n, from a point of the unit square: uniform on the disc, lifted to the
/// hemisphere (Malley's method; Pharr, Jakob & Humphreys 2023, section A.5.3).
inline glm::dvec3 cosine_direction(const glm::dvec3& n, const glm::dvec2& x) {
  const double r = std::sqrt(x.x), phi = 2.0 * std::numbers::pi * x.y;
  const OrthonormalBasis basis(n);
  return r * std::cos(phi) * basis.u + r * std::sin(phi) * basis.v + std::sqrt(std::max(0.0, 1.0 - x.x)) * n;
}

} // namespace daylit
