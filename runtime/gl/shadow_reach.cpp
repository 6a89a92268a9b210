#include "runtime/gl/shadow_reach.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

namespace daylit {

/// Seen from the point, the sphere lies within the cone of directions or touches it.
bool ShadowReach::from_cone(const LightCone& cone, const glm::vec3& offset) const {
  if (cone.empty())
    return false;
  const float squared = glm::dot(offset, offset), tangent = std::sqrt(std::max(squared - radius * radius, 0.0f));
  if (tangent <= 0.0f)
    return true;
  // Both sides times the distance.
  const bool all_around = cone.cosine < 0.0f && radius * radius >= cone.sine * cone.sine * squared;
  return all_around || -glm::dot(cone.axis, offset) >= tangent * cone.cosine - radius * cone.sine;
}

/// False when no ray from x that meets the sphere leaves through a window: the sphere is outside of a plane through x
/// and one of the edges. Those planes are n h(x) - m d(x), n and m of edge and window, h and d of x. Edges of windows
/// with more than four are asked four by four: too many pass, none is lost.
bool ShadowReach::stands_before_window(const glm::vec3& x, const glm::vec3& offset) const {
  return std::any_of(windows.begin(), windows.end(), [&](const WindowEdges& w) {
    const glm::vec3 m(w.plane);
    const float h = glm::dot(m, x) + w.plane.w;
    return h > 0.0f && std::all_of(w.edges.begin(), w.edges.end(), [&](const glm::vec4& edge) {
             const glm::vec3 n(edge), across = n * h - m * (glm::dot(n, x) + edge.w);
             const float beyond = std::max(glm::dot(across, offset), 0.0f), reach = 1.0001f * radius;
             return beyond * beyond <= reach * reach * glm::dot(across, across);
           });
  });
}

bool ShadowReach::meets(const glm::vec3& x) const {
  const glm::vec3 offset = x - centre;
  return (from_cone(sky, offset) || from_cone(sun, offset)) && stands_before_window(x, offset);
}

} // namespace daylit
