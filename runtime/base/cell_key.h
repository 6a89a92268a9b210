#pragma once

#include <cmath>
#include <compare>
#include <cstdint>

#include <glm/vec3.hpp>

namespace daylit {

/// Of cubes of that side.
struct CellKey {
  std::int64_t x = 0, y = 0, z = 0;
  CellKey(const glm::dvec3& p, double side)
      : x(std::llround(p.x / side)), y(std::llround(p.y / side)), z(std::llround(p.z / side)) {}
  auto operator<=>(const CellKey&) const = default;
  glm::dvec3 centre(double side) const { return side * glm::dvec3(x, y, z); }
};

} // namespace daylit
