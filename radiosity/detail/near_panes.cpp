#include "radiosity/detail/near_panes.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include <glm/geometric.hpp>

namespace daylit::radiosity {

namespace {

// Of the width of the pane:
constexpr double kEdge = 0.25, kAtCorner = 1.0 / 16, kFoot = 0.125, kHighest = 0.5, kDeepest = 0.5, kInPane = 1e-3;
constexpr double kFrame = 1.0 / 32;                     // in the shadow of one that is higher
constexpr double kFirst = 0.125, kShallowest = 1.0 / 6; // of a plane that begins outside
constexpr double kOfDistance = 0.7;
constexpr double kLevel = 0.94; // cosine of 20 degrees
constexpr double kAcross = 0.7; // cosine between the normals of face and pane, at most

double distance_to_nearest(const std::vector<glm::dvec3>& corners, const glm::dvec3& p) {
  double least = std::numeric_limits<double>::infinity();
  for (const glm::dvec3& corner : corners)
    least = std::min(least, glm::length(p - corner));
  return least;
}

/// Those at its foot: of a round window few.
std::vector<glm::dvec3> lower_corners(const PaneOutline& pane) {
  double lowest = std::numeric_limits<double>::infinity();
  for (const glm::dvec3& corner : pane.corners)
    lowest = std::min(lowest, corner.z);
  std::vector<glm::dvec3> lower;
  std::ranges::copy_if(pane.corners, std::back_inserter(lower),
                       [&](const glm::dvec3& corner) { return corner.z <= lowest + kFoot * pane.width_m; });
  return lower;
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
    const auto sill = std::ranges::find_if(reveals, [&](std::size_t g) { return is_sill(groups[g], pane); });
    if (sill != reveals.end())
      for (const std::size_t g : reveals)
        panes_[g].push_back({pane, lower_corners(pane), groups[*sill].point.z});
  }
}

bool NearPanes::empty() const {
  return std::ranges::all_of(panes_, [](const std::vector<PaneAboveSill>& panes) { return panes.empty(); });
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

/// kOfDistance of the distance to the outline, w / 4 at least, on a sill below a frame w / 32; the distance to a lower
/// corner, w / 16 at least.
double NearPanes::edge_m(const glm::dvec3& p, std::size_t group) const {
  double longest = std::numeric_limits<double>::infinity();
  for (const PaneAboveSill& pane : panes_[group]) {
    const double w = pane.outline.width_m;
    if (std::abs(p.z - pane.sill_z_m) > kHighest * w)
      continue;
    const bool below_frame =
        pane.lower_corners.front().z - pane.sill_z_m > kFrame * w && std::abs(p.z - pane.sill_z_m) < kFrame * w;
    const double least = (below_frame ? kFrame : kEdge) * w;
    longest = std::min(longest, std::max(least, kOfDistance * pane.outline.distance(p)));
    if (const double from_corner = distance_to_nearest(pane.lower_corners, p); from_corner < kEdge * w)
      longest = std::min(longest, std::max(kAtCorner * w, from_corner));
  }
  return longest;
}

} // namespace daylit::radiosity
