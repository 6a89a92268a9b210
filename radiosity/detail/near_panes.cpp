#include "radiosity/detail/near_panes.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/geometric.hpp>

namespace daylit::radiosity {

namespace {

// Of the width of the pane:
constexpr double kEdge = 0.25, kReach = 0.125, kAtCorner = 1.0 / 16, kDeepest = 0.5, kInPane = 1e-3;
constexpr double kFirst = 0.125, kShallowest = 1.0 / 6; // of a plane that begins outside
constexpr double kLevel = 0.94;                         // cosine of 20 degrees
constexpr double kAcross = 0.7;                         // cosine between the normals of face and pane, at most

double distance_to_corner(const PaneOutline& pane, const glm::dvec3& p) {
  double least = std::numeric_limits<double>::infinity();
  for (const glm::dvec3& corner : pane.corners)
    least = std::min(least, glm::length(p - corner));
  return least;
}

} // namespace

NearPanes::NearPanes(std::span<const Aperture> panes, const glm::dvec3& origin, std::span<const PlaneGroup> groups)
    : panes_(groups.size()) {
  for (const Aperture& a : panes) {
    const PaneOutline pane(a, origin);
    std::vector<std::size_t> reveals;
    for (std::size_t g = 0; g < groups.size(); ++g)
      if (is_reveal(groups[g], pane))
        reveals.push_back(g);
    if (std::ranges::any_of(reveals, [&](std::size_t g) { return is_sill(groups[g], pane); }))
      for (const std::size_t g : reveals)
        panes_[g].push_back(pane);
  }
}

/// One that goes on beyond the pane counts only where much of it lies inside.
bool NearPanes::is_reveal(const PlaneGroup& group, const PaneOutline& pane) {
  double first = 0.0, deepest = 0.0;
  for (const auto& triangle : group.triangles)
    for (const glm::dvec2& corner : triangle) {
      const double inside = glm::dot(group.lift(corner) - pane.corners[0], pane.inward) / pane.width_m;
      first = std::min(first, inside);
      deepest = std::max(deepest, inside);
    }
  return std::abs(glm::dot(group.normal, pane.inward)) <= kAcross && deepest <= kDeepest &&
         (first >= -kInPane || (first >= -kFirst && deepest >= kShallowest));
}

/// Level and below the middle of the pane: things can stand on it.
bool NearPanes::is_sill(const PlaneGroup& group, const PaneOutline& pane) {
  double middle_m = 0.0;
  for (const glm::dvec3& corner : pane.corners)
    middle_m += corner.z / static_cast<double>(pane.corners.size());
  return std::abs(group.normal.z) >= kLevel && group.point.z < middle_m;
}

/// w / 4 within w / 8 of the outline; at a corner, where sill and reveal light each other, the distance to it.
double NearPanes::edge_m(const glm::dvec3& p, std::size_t group) const {
  double longest = std::numeric_limits<double>::infinity();
  for (const PaneOutline& pane : panes_[group]) {
    const double w = pane.width_m, from_corner = distance_to_corner(pane, p);
    if (pane.distance(p) <= kReach * w)
      longest = std::min(longest, kEdge * w);
    if (from_corner < kEdge * w)
      longest = std::min(longest, std::max(kAtCorner * w, from_corner));
  }
  return longest;
}

} // namespace daylit::radiosity
