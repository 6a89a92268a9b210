#include "scene/room/cone.h"

#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

namespace daylit::detail {

namespace {

constexpr double kTouch = 1e-12; // sine of an angle: below it corners lie on a plane

/// Van Oosterom & Strackee 1983, eq. 8; unit corners, signed.
/// tan(Omega/2) = a.(b x c) / (1 + a.b + b.c + c.a), steradians.
double triangle_sr(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
  const double volume = glm::dot(a, glm::cross(b, c));
  return 2.0 * std::atan2(volume, 1.0 + glm::dot(a, b) + glm::dot(b, c) + glm::dot(c, a));
}

/// Normal of the plane through the eye and edge k, pointing into the cone; its length is the sine of the edge.
glm::dvec3 edge_plane(std::span<const glm::dvec3> cone, std::size_t k) {
  return glm::cross(cone[k], cone[(k + 1) % cone.size()]);
}

/// True when no corner is in front of the plane by more than rounding.
bool is_outside(const Cone& cone, const glm::dvec3& plane) {
  const double rounding = kTouch * glm::length(plane);
  for (const glm::dvec3& d : cone)
    if (glm::dot(d, plane) > rounding)
      return false;
  return true;
}

} // namespace

/// Directions to the corners, equal neighbours joined, turned counter-clockwise by the sign of the triple products.
Cone cone_of(const std::vector<glm::dvec3>& corners, const glm::dvec3& eye) {
  Cone cone;
  for (const glm::dvec3& corner : corners) {
    const double distance = glm::distance(corner, eye);
    if (!(distance > 0.0))
      return {};
    const glm::dvec3 d = (corner - eye) / distance;
    if (cone.empty() || glm::distance(d, cone.back()) > kTouch)
      cone.push_back(d);
  }
  while (cone.size() > 1 && glm::distance(cone.front(), cone.back()) <= kTouch)
    cone.pop_back();
  if (cone.size() < 3)
    return {};
  double volume = 0.0;
  for (std::size_t k = 1; k + 1 < cone.size(); ++k)
    volume += glm::dot(cone[0], glm::cross(cone[k], cone[k + 1]));
  if (std::abs(volume) < kTouch)
    return {};
  return volume > 0.0 ? cone : Cone(cone.rbegin(), cone.rend());
}

/// A regular spherical polygon whose angular radius is scaled until its solid angle is that of the disc,
/// 4 pi sin^2(r/2).
Cone cone_of_disc(const glm::dvec3& axis, double angular_radius, int sides) {
  const glm::dvec3 other = std::abs(axis.z) < 0.9 ? glm::dvec3(0, 0, 1) : glm::dvec3(1, 0, 0);
  const glm::dvec3 t = glm::normalize(glm::cross(other, axis)), b = glm::cross(axis, t);
  const double disc = 4.0 * std::numbers::pi * std::pow(std::sin(0.5 * angular_radius), 2);
  const auto polygon = [&](double radius) {
    Cone cone;
    for (int k = 0; k < sides; ++k) {
      const double angle = 2.0 * std::numbers::pi * (k + 0.5) / sides;
      cone.push_back(std::cos(radius) * axis + std::sin(radius) * (std::cos(angle) * t + std::sin(angle) * b));
    }
    return cone;
  };
  double radius = angular_radius;
  for (int step = 0; step < 4; ++step) // solid angle grows with the square
    radius *= std::sqrt(disc / solid_angle_sr(polygon(radius)));
  return polygon(radius);
}

/// Sutherland & Hodgman 1974, one plane; a cut edge keeps its plane because the new corner is on the chord.
Cone clipped(const Cone& cone, const glm::dvec3& plane) {
  Cone part;
  for (std::size_t k = 0; k < cone.size(); ++k) {
    const glm::dvec3 &a = cone[k], &b = cone[(k + 1) % cone.size()];
    const double ha = glm::dot(a, plane), hb = glm::dot(b, plane);
    if (ha >= 0.0)
      part.push_back(a);
    if ((ha > 0.0 && hb < 0.0) || (ha < 0.0 && hb > 0.0))
      part.push_back(glm::normalize(a + ha / (ha - hb) * (b - a)));
  }
  return part.size() < 3 ? Cone{} : part;
}

Cone intersection(const Cone& cone, const Cone& other) {
  Cone part = cone;
  for (std::size_t k = 0; k < other.size() && !part.empty(); ++k)
    part = clipped(part, edge_plane(other, k));
  return part;
}

/// Cuts along the planes of `other` in turn: what lies outside one of them is a part, what is inside all is returned.
Cone subtract(const Cone& cone, const Cone& other, std::vector<Cone>& parts) {
  Cone inside = cone;
  for (std::size_t k = 0; k < other.size() && !inside.empty(); ++k) {
    const glm::dvec3 plane = edge_plane(other, k);
    if (Cone outside = clipped(inside, -plane); !outside.empty() && !is_outside(outside, -plane))
      parts.push_back(std::move(outside));
    inside = clipped(inside, plane);
    if (!inside.empty() && is_outside(inside, plane))
      inside.clear();
  }
  return inside;
}

/// Separating planes: two convex cones are apart when an edge plane of one has the other outside.
bool may_overlap(const Cone& a, const Cone& b) {
  for (std::size_t k = 0; k < a.size(); ++k)
    if (is_outside(b, edge_plane(a, k)))
      return false;
  for (std::size_t k = 0; k < b.size(); ++k)
    if (is_outside(a, edge_plane(b, k)))
      return false;
  return true;
}

bool contains(const Cone& outer, const Cone& inner) {
  for (std::size_t k = 0; k < outer.size(); ++k) {
    const glm::dvec3 plane = edge_plane(outer, k);
    for (const glm::dvec3& d : inner)
      if (glm::dot(d, plane) < 0.0)
        return false;
  }
  return true;
}

/// Fan of triangles around the first corner.
double solid_angle_sr(std::span<const glm::dvec3> cone) {
  double sum = 0.0;
  for (std::size_t k = 1; k + 1 < cone.size(); ++k)
    sum += triangle_sr(cone[0], cone[k], cone[k + 1]);
  return sum;
}

/// 1/2 sum over edges of (arc length) (unit normal of the edge plane): Lambert's formula (1760).
glm::dvec3 vector_area(std::span<const glm::dvec3> cone) {
  glm::dvec3 sum(0.0);
  for (std::size_t k = 0; k < cone.size(); ++k) {
    const glm::dvec3 normal = edge_plane(cone, k);
    const double sine = glm::length(normal);
    if (sine > 0.0)
      sum += 0.5 * std::atan2(sine, glm::dot(cone[k], cone[(k + 1) % cone.size()])) / sine * normal;
  }
  return sum;
}

glm::dvec3 centroid(std::span<const glm::dvec3> cone) {
  glm::dvec3 sum(0.0);
  for (const glm::dvec3& d : cone)
    sum += d;
  return glm::normalize(sum);
}

} // namespace daylit::detail
