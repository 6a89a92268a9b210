#include "radiosity/detail/near_panes.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/geometric.hpp>

#include "scene/core/segment.h"

namespace daylit::radiosity {

namespace {

// Of the width of the pane:
constexpr double kEdge = 0.25, kReach = 0.125, kDeepest = 0.5, kInPane = 1e-3;
constexpr double kAcross = 0.7; // cosine between the normals of face and pane, at most

/// To the nearest of its sides.
double distance_to_outline(const glm::dvec3& p, const std::vector<glm::dvec3>& corners) {
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < corners.size(); ++k)
    nearest = std::min(nearest, distance_to_segment(p, corners[k], corners[(k + 1) % corners.size()]));
  return nearest;
}

/// The least extent across one of its sides.
double width_of(const std::vector<glm::dvec3>& corners, const glm::dvec3& normal) {
  double width = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const glm::dvec3 side = corners[(k + 1) % corners.size()] - corners[k];
    if (side == glm::dvec3(0.0))
      continue;
    const glm::dvec3 across = glm::cross(side, normal) / glm::length(side);
    double extent = 0;
    for (const glm::dvec3& c : corners)
      extent = std::max(extent, std::abs(glm::dot(c - corners[k], across)));
    width = std::min(width, extent);
  }
  return width;
}

} // namespace

NearPanes::NearPanes(std::span<const Aperture> panes, const glm::dvec3& origin, std::span<const PlaneGroup> groups)
    : panes_(groups.size()) {
  for (const Aperture& a : panes) {
    Pane pane{a.corners, a.inward, width_of(a.corners, a.inward)};
    for (glm::dvec3& c : pane.corners)
      c -= origin;
    for (std::size_t g = 0; g < groups.size(); ++g)
      if (is_reveal(groups[g], pane))
        panes_[g].push_back(pane);
  }
}

bool NearPanes::is_reveal(const PlaneGroup& group, const Pane& pane) {
  const auto beside = [&](const glm::dvec2& corner) {
    const double inside = glm::dot(group.lift(corner) - pane.corners[0], pane.inward) / pane.width_m;
    return inside >= -kInPane && inside <= kDeepest;
  };
  return std::abs(glm::dot(group.normal, pane.inward)) <= kAcross &&
         std::ranges::all_of(group.triangles, [&](const auto& t) { return std::ranges::all_of(t, beside); });
}

/// w / 4 within w / 8.
double NearPanes::edge_m(const glm::dvec3& p, std::size_t group) const {
  double longest = std::numeric_limits<double>::infinity();
  for (const Pane& pane : panes_[group])
    if (distance_to_outline(p, pane.corners) <= kReach * pane.width_m)
      longest = std::min(longest, kEdge * pane.width_m);
  return longest;
}

} // namespace daylit::radiosity
