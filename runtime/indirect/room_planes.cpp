#include "runtime/indirect/room_planes.h"

#include <algorithm>
#include <cmath>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

#include "scene/core/orthonormal.h"

namespace daylit {

namespace {
constexpr double kPlaneTolerance_m = 1e-6;
}

/// (i, j) = floor((u.x, v.x) / cell); weights (1 - s)(1 - t), s (1 - t), (1 - s) t, s t of the rest (s, t).
LatticeSquare RoomFacing::square(const glm::dvec3& x, double cell_m) const {
  const glm::dvec2 p(glm::dot(u, x) / cell_m, glm::dot(v, x) / cell_m), lower = glm::floor(p);
  const glm::vec2 t(p - lower);
  return {static_cast<std::int64_t>(lower.x),
          static_cast<std::int64_t>(lower.y),
          {(1 - t.x) * (1 - t.y), t.x * (1 - t.y), (1 - t.x) * t.y, t.x * t.y}};
}

/// Diagonals first: they are the longest.
bool see_each_other(const RayScene& room_rays, const std::array<glm::dvec3, 4>& points) {
  constexpr std::size_t kPairs[6][2] = {{0, 3}, {1, 2}, {0, 1}, {2, 3}, {0, 2}, {1, 3}}; // diagonals first
  return std::ranges::all_of(kPairs, [&](const auto& pair) {
    const glm::dvec3 whole = points[pair[1]] - points[pair[0]], gap = kAirGap_m * glm::normalize(whole);
    return !room_rays.occluded(room_rays.to_local(points[pair[0]] - gap), glm::vec3(whole + 2.0 * gap), 0.0f, 1.0f);
  });
}

/// Triangles of one plane: normals within 1e-6 radians, heights within kPlaneTolerance_m.
RoomPlanes::RoomPlanes(const Room& room) {
  for (const RoomTriangle& t : room.triangles) {
    const glm::dvec3 area = area_normal(room, t);
    const glm::dvec3 n = glm::length(area) > 0.0 ? glm::normalize(area) : glm::dvec3(0.0, 0.0, 1.0);
    const double height = glm::dot(n, room.corner(t, 0));
    std::uint32_t plane = 0;
    const auto count = static_cast<std::uint32_t>(facings_.size() / 2);
    // Only runs of neighbours in the file are merged: enough for the quads that rooms are made of, and linear.
    for (plane = count > 8 ? count - 8 : 0; plane < count; ++plane)
      if (glm::dot(facings_[2 * plane].normal, n) > 1.0 - 1e-12 &&
          std::fabs(facings_[2 * plane].height - height) < kPlaneTolerance_m)
        break;
    if (plane == count) {
      const OrthonormalBasis basis(n);
      facings_.push_back({n, basis.u, basis.v, height});
      facings_.push_back({-n, basis.u, basis.v, -height});
    }
    plane_of_triangle_.push_back(plane);
  }
}

/// The side whose normal is against the ray.
std::uint32_t RoomPlanes::facing_of(std::uint32_t triangle, const glm::dvec3& direction) const {
  const std::uint32_t front = 2 * plane_of_triangle_[triangle];
  return glm::dot(facings_[front].normal, direction) > 0.0 ? front + 1 : front;
}

} // namespace daylit
