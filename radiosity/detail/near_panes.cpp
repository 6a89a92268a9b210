#include "radiosity/detail/near_panes.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/geometric.hpp>

namespace daylit::radiosity {

namespace {

constexpr double kOfDistance = 1.5;
constexpr double kShortest_m = 0.12;
constexpr double kReach_m = 0.3;
constexpr double kInPane_m = 1e-3;
constexpr double kAcross = 0.7; ///< cosine between the normals of face and pane, at most

double distance_to_segment(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b) {
  const glm::dvec3 along = b - a;
  const double t = std::clamp(glm::dot(p - a, along) / glm::dot(along, along), 0.0, 1.0);
  return glm::distance(p, a + t * along);
}

/// To a convex polygon that is seen counter-clockwise or clockwise: its plane's distance above it, else the nearest
/// side.
double distance_to_polygon(const glm::dvec3& p, const std::vector<glm::dvec3>& corners, const glm::dvec3& normal) {
  double nearest = std::numeric_limits<double>::infinity();
  bool left = true, right = true;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const glm::dvec3 &a = corners[k], &b = corners[(k + 1) % corners.size()];
    const double side = glm::dot(glm::cross(b - a, p - a), normal);
    left = left && side >= 0.0;
    right = right && side <= 0.0;
    nearest = std::min(nearest, distance_to_segment(p, a, b));
  }
  return left || right ? std::abs(glm::dot(p - corners[0], normal)) : nearest;
}

} // namespace

NearPanes::NearPanes(std::span<const Aperture> panes, const glm::dvec3& origin) {
  for (const Aperture& a : panes) {
    panes_.push_back({a.corners, a.inward});
    for (glm::dvec3& c : panes_.back().corners)
      c -= origin;
  }
}

/// max(12 cm, 1.5 d) of the nearest pane.
double NearPanes::edge_m(const glm::dvec3& p, const glm::dvec3& normal) const {
  double longest = std::numeric_limits<double>::infinity();
  for (const Pane& pane : panes_) {
    const double inside_m = glm::dot(p - pane.corners[0], pane.inward);
    if (inside_m < -kInPane_m || inside_m > kReach_m || std::abs(glm::dot(normal, pane.inward)) > kAcross)
      continue;
    const double d = distance_to_polygon(p, pane.corners, pane.inward);
    if (d <= kReach_m)
      longest = std::min(longest, std::max(kOfDistance * d, kShortest_m));
  }
  return longest;
}

} // namespace daylit::radiosity
