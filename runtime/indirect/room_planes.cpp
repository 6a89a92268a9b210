#include "runtime/indirect/room_planes.h"

#include <cmath>

#include <glm/geometric.hpp>

#include "runtime/base/orthonormal.h"

namespace daylit {

namespace {
constexpr double kPlaneTolerance_m = 1e-6;
}

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

std::uint32_t RoomPlanes::facing_of(std::uint32_t triangle, const glm::dvec3& direction) const {
  const std::uint32_t front = 2 * plane_of_triangle_[triangle];
  return glm::dot(facings_[front].normal, direction) > 0.0 ? front + 1 : front;
}

} // namespace daylit
