#include "runtime/trace/shadow_bounds.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

#include "runtime/base/orthonormal.h"

namespace daylit {

namespace {

constexpr std::size_t kRun = 16;

float squared_distance_to_segment(const glm::vec2& a, const glm::vec2& b) {
  const glm::vec2 d = b - a;
  const float length2 = glm::dot(d, d), t = length2 > 0.0f ? std::clamp(-glm::dot(a, d) / length2, 0.0f, 1.0f) : 0.0f;
  const glm::vec2 nearest = a + t * d;
  return glm::dot(nearest, nearest);
}

/// The disc of the given radius around the origin and the triangle share a point.
bool disc_meets_triangle(const std::array<glm::vec2, 3>& p, float radius) {
  int left = 0, right = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const glm::vec2 &a = p[k], &b = p[(k + 1) % 3];
    if (squared_distance_to_segment(a, b) <= radius * radius)
      return true;
    const float side = a.x * b.y - a.y * b.x;
    left += side > 0.0f;
    right += side < 0.0f;
  }
  return left == 3 || right == 3; // the origin lies within
}

} // namespace

ShadowBounds::ShadowBounds(std::span<const glm::vec3> vertices,
                             std::span<const std::array<std::uint32_t, 3>> triangles) {
  for (const auto& t : triangles)
    triangles_.push_back({vertices[t[0]], vertices[t[1]], vertices[t[2]]});
  for (std::size_t first = 0; first < triangles_.size(); first += kRun) {
    Run run{{}, 0.0f, first, std::min(first + kRun, triangles_.size())};
    glm::vec3 lo = triangles_[first][0], hi = lo;
    for (std::size_t i = run.first; i < run.last; ++i)
      for (const glm::vec3& p : triangles_[i]) {
        lo = glm::min(lo, p);
        hi = glm::max(hi, p);
      }
    run.centre = 0.5f * (lo + hi);
    run.radius = 0.5001f * glm::length(hi - lo);
    runs_.push_back(run);
  }
}

bool ShadowBounds::may_block(const glm::vec3& w, const glm::vec3& centre, float radius) const {
  const OrthonormalBasis basis{glm::dvec3(w)};
  const glm::vec3 u(basis.u), v(basis.v);
  for (const Run& run : runs_) {
    const glm::vec3 d = run.centre - centre;
    const float along = glm::dot(d, w), both = radius + run.radius;
    if (along < -both || glm::dot(d, d) - along * along > both * both)
      continue;
    for (std::size_t i = run.first; i < run.last; ++i) {
      std::array<glm::vec2, 3> across;
      bool ahead = false;
      for (std::size_t k = 0; k < 3; ++k) {
        const glm::vec3 p = triangles_[i][k] - centre;
        across[k] = {glm::dot(p, u), glm::dot(p, v)};
        ahead = ahead || glm::dot(p, w) > -radius;
      }
      if (ahead && disc_meets_triangle(across, radius))
        return true;
    }
  }
  return false;
}

} // namespace daylit
