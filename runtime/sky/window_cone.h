#pragma once

// Which directions of the sky can reach a bounding sphere through the apertures (Grosch et al. 2007, section 7.1).

#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "runtime/base/bounding_sphere.h"
#include "scene/room/room.h"

namespace daylit {

/// For each edge of an aperture the plane through the edge that is tangent to the sphere, sphere and aperture on
/// opposite sides: every ray from the sphere through the aperture crosses it outwards. Conservative: never rejects a
/// direction in which some point of the sphere sees through an aperture.
class WindowCone {
public:
  WindowCone(std::span<const Aperture> apertures, const BoundingSphere& sphere);

  /// True unless no direction within `slack` radians of the unit direction w reaches the sphere through an aperture.
  bool allows(const glm::dvec3& w, double slack = 0.0) const;
  /// Fraction of the sphere's silhouette disc that sees out of an aperture in direction w, 0..1: each edge cuts the
  /// disc along a straight line, the fractions of the edges are multiplied. A weight for sampling, not a visibility.
  double visible_fraction(const glm::dvec3& w) const;
  /// No aperture faces the sphere.
  bool empty() const { return windows_.empty(); }

private:
  struct Edge {
    glm::dvec3 direction; ///< unit, counter-clockwise seen from the inside of the room
    glm::dvec3 to_centre; ///< sphere centre - first corner, metres
  };
  struct Window {
    glm::dvec3 inward;
    std::vector<glm::dvec3> tangent_normal; ///< dot(n, w) >= 0 for every ray from the sphere through the aperture
    std::vector<Edge> edges;
  };
  std::vector<Window> windows_;
  double radius_;
};

} // namespace daylit
