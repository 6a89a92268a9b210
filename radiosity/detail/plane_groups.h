#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "scene/room/room.h"

namespace daylit::radiosity {

/// Coplanar triangles of one material, whichever way they face, in the plane's own 2-D frame.
struct PlaneGroup {
  glm::dvec3 point{0.0}, normal{0.0}, axis_u{0.0}, axis_v{0.0}; ///< local metres; u, v, normal right-handed
  std::uint32_t material = 0;
  std::vector<std::array<glm::dvec2, 3>> triangles;
  /// What an earlier group of another material covers of this one: there the surface is the other's.
  std::vector<std::array<glm::dvec2, 3>> covered;
  /// Where triangles of other planes touch or cross this plane, metres in (u, v).
  std::vector<std::array<glm::dvec2, 2>> contacts;

  glm::dvec3 lift(const glm::dvec2& p) const { return point + p.x * axis_u + p.y * axis_v; }
  glm::dvec2 flatten(const glm::dvec3& p) const;
};

/// Groups the reflecting triangles of a room; coordinates relative to `origin`.
std::vector<PlaneGroup> group_planes(const Room& room, const glm::dvec3& origin);

} // namespace daylit::radiosity
