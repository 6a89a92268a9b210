#pragma once

// Everything that can stand between two facets, as few convex polygons.

#include <vector>

#include <glm/vec3.hpp>

#include "scene/room/room.h"

namespace daylit::radiosity {

/// Planar, convex, two-sided.
struct Obstacle {
  std::vector<glm::dvec3> corner; ///< metres, counter-clockwise about the normal
  glm::dvec3 normal{0.0};         ///< unit
};

/// The reflecting triangles of a room, coordinates relative to `origin`; neighbours in one plane are merged as long as
/// the outline stays convex (after Hertel & Mehlhorn 1983). Triangles without area are left out.
std::vector<Obstacle> convex_obstacles(const Room& room, const glm::dvec3& origin);

} // namespace daylit::radiosity
