#include "runtime/sky/window_cone.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

namespace daylit {

namespace {

/// Normals n perpendicular to the edge with dot(n, centre - corner) = -radius and the aperture on their positive side:
/// dot(n, p - x) >= 0 for all aperture points p and sphere points x. None when the sphere touches the edge's line.
void append_tangent_normals(const glm::dvec3& edge, const glm::dvec3& into_aperture, const glm::dvec3& to_centre,
                            double radius, std::vector<glm::dvec3>& normals) {
  const glm::dvec3 across = to_centre - glm::dot(to_centre, edge) * edge;
  const double distance = glm::length(across);
  if (distance <= radius)
    return;
  const glm::dvec3 u = across / distance, t = glm::cross(edge, u);
  const double c = -radius / distance, s = std::sqrt(std::max(1.0 - c * c, 0.0));
  for (const double side : {-s, s}) {
    const glm::dvec3 n = c * u + side * t;
    if (glm::dot(n, into_aperture) >= 0.0)
      normals.push_back(n);
  }
}

/// Fraction of a unit disc on the positive side of a line at signed distance s from its centre.
double disc_fraction(double s) {
  if (s <= -1.0)
    return 0.0;
  if (s >= 1.0)
    return 1.0;
  return 0.5 + (std::asin(s) + s * std::sqrt(1.0 - s * s)) / std::numbers::pi;
}

} // namespace

/// Portal clip planes (Grosch et al. 2007, section 7.1): for each edge the planes that touch the sphere.
WindowCone::WindowCone(std::span<const Aperture> apertures, const BoundingSphere& sphere) : radius_(sphere.radius) {
  for (const Aperture& a : apertures) {
    if (a.corners.size() < 3 || glm::dot(a.inward, sphere.centre - a.corners[0]) < -sphere.radius)
      continue; // the whole sphere is outside this window
    glm::dvec3 middle(0.0);
    for (const glm::dvec3& c : a.corners)
      middle += c / static_cast<double>(a.corners.size());
    Window window{a.inward, {}, {}};
    for (std::size_t k = 0; k < a.corners.size(); ++k) {
      const glm::dvec3 corner = a.corners[k], span = a.corners[(k + 1) % a.corners.size()] - corner;
      if (glm::length(span) <= 0.0)
        continue;
      glm::dvec3 edge = glm::normalize(span);
      if (glm::dot(glm::cross(a.inward, edge), middle - corner) < 0.0)
        edge = -edge;
      const glm::dvec3 into_aperture = glm::cross(a.inward, edge);
      append_tangent_normals(edge, into_aperture, sphere.centre - corner, sphere.radius, window.tangent_normal);
      window.edges.push_back({edge, sphere.centre - corner});
    }
    windows_.push_back(std::move(window));
  }
}

/// n.w >= 0 for all clip planes of one window, and w leaves the room; with `slack` both by -sin(slack).
bool WindowCone::allows(const glm::dvec3& w, double slack) const {
  const double margin = std::sin(std::min(slack, 0.5 * std::numbers::pi));
  return std::any_of(windows_.begin(), windows_.end(), [&](const Window& window) {
    return glm::dot(window.inward, w) < margin &&
           std::all_of(window.tangent_normal.begin(), window.tangent_normal.end(),
                       [&](const glm::dvec3& n) { return glm::dot(n, w) >= -margin; });
  });
}

/// Seen along w the sphere is a disc, and each edge of the aperture a line at signed distance
/// s = n.(c - corner) / radius, n = edge x w / |edge x w|, from its middle. The product of the edges' fractions is
/// exact for one edge, and for edges that cut the disc independently.
double WindowCone::visible_fraction(const glm::dvec3& w) const {
  double fraction = 0.0;
  for (const Window& window : windows_) {
    if (glm::dot(window.inward, w) >= 0.0)
      continue;
    double product = 1.0;
    for (const Edge& e : window.edges) {
      // Plane through the edge along w, normal towards the aperture's inside as the sphere sees it.
      const glm::dvec3 n = glm::cross(e.direction, w);
      const double length = glm::length(n);
      if (length > 0.0 && radius_ > 0.0)
        product *= disc_fraction(glm::dot(n, e.to_centre) / (length * radius_));
    }
    fraction += product;
  }
  return std::min(fraction, 1.0);
}

} // namespace daylit
