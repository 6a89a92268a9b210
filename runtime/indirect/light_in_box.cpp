#include "runtime/indirect/light_in_box.h"

#include <numbers>

#include <glm/matrix.hpp>

#include "runtime/base/sh_rotation.h"

namespace daylit {

namespace {

void add(SeenOfObject& sum, float weight, const SeenOfObject& seen) {
  sum.irradiance.front += weight * seen.irradiance.front;
  sum.irradiance.back += weight * seen.irradiance.back;
  sum.hidden_front += weight * seen.hidden_front;
  sum.hidden_back += weight * seen.hidden_back;
}

/// L = sum E / (pi sum of the hidden fractions).
Rgb mean_radiance(const Rgb& irradiance, float hidden) {
  return hidden > 0.0f ? irradiance * std::numbers::inv_pi_v<float> / hidden : Rgb(0.0f);
}

} // namespace

void LightInBox::add(const glm::dvec3& x, const Sh9Rgb& from_room, const SeenOfObject& seen) {
  for (const BoxLattice::Corner& c : lattice_.around(x)) {
    Point& point = points_[c.point];
    point.weight += c.weight;
    for (std::size_t i = 0; i < from_room.size(); ++i)
      point.sum[i] += c.weight * from_room[i];
    daylit::add(point.seen, c.weight, seen);
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
LightAtPoint LightInBox::at(const glm::dvec3& x) const {
  Sh9Rgb light{};
  SeenOfObject seen;
  float whole = 0.0f;
  for (const BoxLattice::Corner& c : lattice_.around(x))
    if (const Point& point = points_[c.point]; point.weight > 0.0f && c.weight > 0.0f) {
      whole += c.weight;
      for (std::size_t i = 0; i < light.size(); ++i)
        light[i] += c.weight * point.sum[i];
      daylit::add(seen, c.weight, point.seen);
    }
  if (whole > 0.0f)
    for (Rgb& l : light)
      l /= whole;
  return {
      light,
      {mean_radiance(seen.irradiance.front, seen.hidden_front), mean_radiance(seen.irradiance.back, seen.hidden_back)}};
}

} // namespace daylit
