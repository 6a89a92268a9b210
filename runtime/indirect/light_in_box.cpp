#include "runtime/indirect/light_in_box.h"

#include <glm/matrix.hpp>

#include "runtime/base/sh_rotation.h"

namespace daylit {

void LightInBox::add(const glm::dvec3& x, const Sh9Rgb& light) {
  for (const BoxLattice::Corner& c : lattice_.around(x)) {
    Point& point = points_[c.point];
    point.weight += c.weight;
    for (std::size_t i = 0; i < light.size(); ++i)
      point.sum[i] += c.weight * light[i];
  }
}

void LightInBox::turn(const glm::mat3& world_from_box) {
  const glm::mat3 box_from_world = glm::transpose(world_from_box);
  for (Point& point : points_)
    if (point.weight > 0.0f) {
      point.sum = rotate9(box_from_world, point.sum);
      for (Rgb& light : point.sum)
        light /= point.weight;
    }
}

/// L(x) = sum_k w_k L_k / sum_k w_k over the points that know some light.
Sh9Rgb LightInBox::at(const glm::dvec3& x) const {
  Sh9Rgb light{};
  float whole = 0.0f;
  for (const BoxLattice::Corner& c : lattice_.around(x))
    if (const Point& point = points_[c.point]; point.weight > 0.0f && c.weight > 0.0f) {
      whole += c.weight;
      for (std::size_t i = 0; i < light.size(); ++i)
        light[i] += c.weight * point.sum[i];
    }
  if (whole > 0.0f)
    for (Rgb& l : light)
      l /= whole;
  return light;
}

} // namespace daylit
