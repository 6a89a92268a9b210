#include "runtime/trace/shadow_bounds.h"

#include <algorithm>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

#include "runtime/base/orthonormal.h"

namespace daylit {

namespace {

/// The disc of the given radius around the origin and the triangle share a point: an edge passes within the radius, or
/// the origin lies on the same side of all edges.
bool disc_meets_triangle(const std::array<glm::vec2, 3>& p, float radius) {
  int left = 0, right = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const glm::vec2 &a = p[k], d = p[(k + 1) % 3] - a;
    const float length2 = glm::dot(d, d), t = length2 > 0.0f ? std::clamp(-glm::dot(a, d) / length2, 0.0f, 1.0f) : 0.0f;
    const glm::vec2 nearest = a + t * d;
    if (glm::dot(nearest, nearest) <= radius * radius)
      return true;
    const float side = a.x * d.y - a.y * d.x;
    left += side > 0.0f;
    right += side < 0.0f;
  }
  return left == 3 || right == 3;
}

} // namespace

ShadowBounds::ShadowBounds(std::span<const glm::vec3> vertices,
                           std::span<const std::array<std::uint32_t, 3>> triangles) {
  for (const auto& t : triangles) {
    const glm::vec3 &a = vertices[t[0]], &b = vertices[t[1]], &c = vertices[t[2]];
    const glm::vec3 lo = glm::min(a, glm::min(b, c)), hi = glm::max(a, glm::max(b, c));
    triangles_.push_back({{a, b, c}, 0.5f * (lo + hi), 0.5001f * glm::length(hi - lo)});
  }
}

/// The rays fill a half-infinite cylinder with a round end. A sphere around the triangle at d meets it when its distance
/// from the axis, sqrt(d.d - (d.w)^2), is at most the sum of the radii and it does not lie wholly behind the end; what
/// is left is decided across the axis.
bool ShadowBounds::may_block(const glm::vec3& w, const glm::vec3& centre, float radius) const {
  const OrthonormalBasis basis{glm::dvec3(w)};
  const glm::vec3 u(basis.u), v(basis.v);
  return std::ranges::any_of(triangles_, [&](const Triangle& t) {
    const glm::vec3 d = t.centre - centre;
    const float along = glm::dot(d, w), both = radius + t.radius;
    if (along < -both || glm::dot(d, d) - along * along > both * both)
      return false;
    std::array<glm::vec2, 3> across;
    bool ahead = false;
    for (std::size_t k = 0; k < 3; ++k) {
      const glm::vec3 p = t.corners[k] - centre;
      across[k] = {glm::dot(p, u), glm::dot(p, v)};
      ahead = ahead || glm::dot(p, w) > -radius;
    }
    return ahead && disc_meets_triangle(across, radius);
  });
}

} // namespace daylit
