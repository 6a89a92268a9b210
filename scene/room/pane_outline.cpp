#include "scene/room/pane_outline.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/geometric.hpp>

#include "scene/core/segment.h"

namespace daylit {

PaneOutline::PaneOutline(const Aperture& aperture, const glm::dvec3& origin)
    : corners(aperture.corners), inward(aperture.inward), width_m(std::numeric_limits<double>::infinity()) {
  for (glm::dvec3& c : corners)
    c -= origin;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const glm::dvec3 side = corners[(k + 1) % corners.size()] - corners[k];
    if (side == glm::dvec3(0.0))
      continue;
    const glm::dvec3 across = glm::cross(side, inward) / glm::length(side);
    double extent = 0;
    for (const glm::dvec3& c : corners)
      extent = std::max(extent, std::abs(glm::dot(c - corners[k], across)));
    width_m = std::min(width_m, extent);
  }
}

double PaneOutline::distance(const glm::dvec3& p) const {
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < corners.size(); ++k)
    nearest = std::min(nearest, distance_to_segment(p, corners[k], corners[(k + 1) % corners.size()]));
  return nearest;
}

} // namespace daylit
