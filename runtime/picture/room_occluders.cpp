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

/// Triangles that are no window, and their vertices.
struct ReflectingSurface {
  std::vector<std::uint32_t> triangles;
  std::vector<glm::dvec3> points;
  explicit ReflectingSurface(const Room& room) {
    std::vector<bool> used(room.vertices.size(), false);
    for (std::uint32_t i = 0; i < room.triangles.size(); ++i)
      if (!room.is_window(room.triangles[i])) {
        triangles.push_back(i);
        for (const std::uint32_t v : room.triangles[i].vertex)
          used[v] = true;
      }
    for (std::size_t v = 0; v < used.size(); ++v)
      if (used[v])
        points.push_back(room.vertices[v]);
  }
};

struct Plane {
  glm::dvec3 normal, point;
  bool contains(const Room& room, const RoomTriangle& t, double tolerance) const {
    for (int k = 0; k < 3; ++k)
      if (std::fabs(glm::dot(normal, room.corner(t, k) - point)) > tolerance)
        return false;
    return true;
  }
};

} // namespace

std::vector<std::uint32_t> occluding_triangles(const Room& room, std::span<const Aperture> apertures) {
  const ReflectingSurface reflecting(room);
  const double tolerance = 1e-5 * glm::length(room.bounds().size());
  for (const Aperture& a : apertures)
    if (!supports(reflecting.points, a.inward, a.corners[0], tolerance))
      return reflecting.triangles;
  std::vector<Plane> supporting; // few: the walls, floor and ceiling
  std::vector<std::uint32_t> occluding;
  for (const std::uint32_t i : reflecting.triangles) {
    const RoomTriangle& t = room.triangles[i];
    const glm::dvec3 n = area_normal(room, t);
    const double length = glm::length(n);
    if (length <= 0.0 ||
        std::ranges::any_of(supporting, [&](const Plane& plane) { return plane.contains(room, t, tolerance); }))
      continue;
    if (supports(reflecting.points, n / length, room.corner(t, 0), tolerance))
      supporting.push_back({n / length, room.corner(t, 0)});
    else
      occluding.push_back(i);
  }
  return occluding;
}

} // namespace daylit
