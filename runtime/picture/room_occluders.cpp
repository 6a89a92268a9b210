#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

#include "runtime/picture/picture_renderer.h"

namespace daylit {

namespace {

/// All vertices used by reflecting triangles lie on one side of the plane, within `tolerance` metres.
bool supports(const std::vector<glm::dvec3>& points, const glm::dvec3& normal, const glm::dvec3& on_plane,
              double tolerance) {
  bool above = false, below = false;
  for (const glm::dvec3& p : points) {
    const double height = glm::dot(normal, p - on_plane);
    above = above || height > tolerance;
    below = below || height < -tolerance;
    if (above && below)
      return false;
  }
  return true;
}

} // namespace

std::vector<std::uint32_t> occluding_triangles(const Room& room, std::span<const Aperture> apertures) {
  std::vector<std::uint32_t> reflecting;
  std::vector<bool> used(room.vertices.size(), false);
  for (std::uint32_t i = 0; i < room.triangles.size(); ++i)
    if (!room.is_window(room.triangles[i])) {
      reflecting.push_back(i);
      for (const std::uint32_t v : room.triangles[i].vertex)
        used[v] = true;
    }
  std::vector<glm::dvec3> points;
  for (std::size_t v = 0; v < used.size(); ++v)
    if (used[v])
      points.push_back(room.vertices[v]);
  const double tolerance = 1e-5 * glm::length(room.bounds().size());
  for (const Aperture& a : apertures)
    if (!supports(points, a.inward, a.corners[0], tolerance))
      return reflecting;

  struct Plane {
    glm::dvec3 normal, point;
  };
  std::vector<Plane> supporting; // few: the walls, floor and ceiling
  std::vector<std::uint32_t> occluding;
  for (const std::uint32_t i : reflecting) {
    const RoomTriangle& t = room.triangles[i];
    const glm::dvec3 n = area_normal(room, t);
    const double length = glm::length(n);
    const auto contains = [&](const Plane& plane) {
      for (int k = 0; k < 3; ++k)
        if (std::fabs(glm::dot(plane.normal, room.corner(t, k) - plane.point)) > tolerance)
          return false;
      return true;
    };
    if (length <= 0.0 || std::any_of(supporting.begin(), supporting.end(), contains))
      continue;
    if (supports(points, n / length, room.corner(t, 0), tolerance))
      supporting.push_back({n / length, room.corner(t, 0)});
    else
      occluding.push_back(i);
  }
  return occluding;
}

} // namespace daylit
