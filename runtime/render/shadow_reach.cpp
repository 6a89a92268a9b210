#include "runtime/render/shadow_reach.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

namespace daylit {

/// Seen from the point, the sphere lies within the cone of directions or touches it.
bool ShadowReach::from_cone(const glm::vec4& cone, const glm::vec3& offset) const {
  if (cone.w < 0.0f)
    return false;
  const float distance = glm::length(offset);
  if (distance <= radius)
    return true;
  const float s = radius / distance, c = std::sqrt(1.0f - s * s); // of the sphere's half angle
  const float cone_c = std::cos(cone.w), cone_s = std::sin(cone.w);
  const bool all_around = cone_c < 0.0f && s >= cone_s;
  return all_around || -glm::dot(glm::vec3(cone), offset) >= distance * (c * cone_c - s * cone_s);
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
             return -glm::dot(across, offset) >= -1.0001f * radius * glm::length(across);
           });
  });
}

bool ShadowReach::meets(const glm::vec3& x) const {
  const glm::vec3 offset = x - centre;
  return stands_before_window(x, offset) && (from_cone(sky_cone, offset) || from_cone(sun_cone, offset));
}

} // namespace daylit
