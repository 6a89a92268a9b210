#include "runtime/reflect/window_points.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

namespace daylit {

WindowPoints::WindowPoints(std::span<const Aperture> apertures) {
  for (const Aperture& a : apertures)
    for (std::size_t k = 2; k < a.corners.size(); ++k) {
      const glm::dvec3 side_a = a.corners[k - 1] - a.corners[0], side_b = a.corners[k] - a.corners[0];
      area_ += 0.5 * glm::length(glm::cross(side_a, side_b));
      triangles_.push_back({a.corners[0], side_a, side_b, area_});
    }
  for (Triangle& t : triangles_)
    t.up_to /= area_;
  if (!(area_ > 0.0))
    triangles_.clear();
}

/// Folds the square into the triangle.
glm::dvec3 WindowPoints::sample(const glm::vec2& u) const {
  const auto x = static_cast<double>(u.x);
  auto t = std::ranges::lower_bound(triangles_, x, {}, &Triangle::up_to);
  if (t == triangles_.end())
    --t;
  const double before = t == triangles_.begin() ? 0.0 : (t - 1)->up_to;
  double a = (x - before) / std::max(t->up_to - before, 1e-12), b = static_cast<double>(u.y);
  if (a + b > 1.0) {
    a = 1.0 - a;
    b = 1.0 - b;
  }
  return t->corner + a * t->side_a + b * t->side_b;
}

/// Moeller & Trumbore 1997.
float WindowPoints::density(const glm::dvec3& x, const glm::vec3& direction) const {
  const glm::dvec3 d(direction);
  double sum = 0.0;
  for (const Triangle& t : triangles_) {
    const glm::dvec3 p = glm::cross(d, t.side_b), from = x - t.corner;
    const double along = glm::dot(t.side_a, p); // twice the area times the cosine
    if (along == 0.0)
      continue;
    const double a = glm::dot(from, p) / along;
    const glm::dvec3 q = glm::cross(from, t.side_a);
    const double b = glm::dot(d, q) / along, r = glm::dot(t.side_b, q) / along;
    if (a < 0.0 || b < 0.0 || a + b > 1.0 || r <= 0.0)
      continue;
    sum += r * r * glm::length(glm::cross(t.side_a, t.side_b)) / std::fabs(along);
  }
  return static_cast<float>(sum / area_);
}

} // namespace daylit
