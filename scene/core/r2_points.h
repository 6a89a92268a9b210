#pragma once

// Points that fill a square or a triangle evenly, any number of them.

#include <array>
#include <cmath>
#include <cstdint>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

namespace daylit {

/// k-th point of the R2 sequence (Roberts 2018), shifted by `shift`; both coordinates in [0, 1).
inline glm::dvec2 r2_point(std::uint32_t k, const glm::dvec2& shift) {
  const double x = shift.x + 0.75487766624669276005 * (k + 1), y = shift.y + 0.56984029099805326591 * (k + 1);
  return {x - std::floor(x), y - std::floor(y)};
}

/// Uniform on a triangle, low distortion (Heitz 2019).
inline glm::dvec3 on_triangle(const std::array<glm::dvec3, 3>& t, glm::dvec2 u) {
  if (u.y > u.x) {
    u.x *= 0.5;
    u.y -= u.x;
  } else {
    u.y *= 0.5;
    u.x -= u.y;
  }
  return t[0] + u.x * (t[1] - t[0]) + u.y * (t[2] - t[0]);
}

} // namespace daylit
