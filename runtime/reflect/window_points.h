#pragma once

// Points on the windows, evenly by area: rays of a wide lobe seldom find a bright window at its rim, so that rays
// straight to it are taken beside them, each weighted by what both ways together would take (Veach & Guibas 1995).

#include <span>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "scene/room/aperture.h"

namespace daylit {

class WindowPoints {
public:
  explicit WindowPoints(std::span<const Aperture> apertures);
  bool empty() const { return triangles_.empty(); }
  /// `u` of the unit square. Not of an empty one.
  glm::dvec3 sample(const glm::vec2& u) const;
  /// Of the direction of sample() from x, per sr: sum over what the ray crosses of r^2 / (A |cosine|).
  float density(const glm::dvec3& x, const glm::vec3& direction) const;

private:
  struct Triangle {
    glm::dvec3 corner, side_a, side_b;
    double up_to = 0.0; ///< part of all area up to its end
  };
  std::vector<Triangle> triangles_;
  double area_ = 0.0;
};

} // namespace daylit
