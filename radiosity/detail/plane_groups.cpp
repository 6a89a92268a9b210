#include "radiosity/detail/plane_groups.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <glm/geometric.hpp>

namespace daylit::radiosity {

namespace {

// Two faces are on one plane when their normals agree to 1e-6 and their offsets to 1e-7 of the room: an order above
// the rounding of coordinates that a modelling program writes with seven digits, far below any real thickness.
constexpr double kNormalTolerance = 1e-6;
constexpr double kOffsetTolerance = 2e-7;

struct LocalTriangle {
  std::array<glm::dvec3, 3> corner;
  glm::dvec3 normal;
  std::uint32_t material;
};

void set_axes(PlaneGroup& g) {
  const glm::dvec3 n = g.normal;
  const glm::dvec3 helper = std::abs(n.z) < 0.9 ? glm::dvec3(0, 0, 1) : glm::dvec3(1, 0, 0);
  g.axis_u = glm::normalize(glm::cross(helper, n));
  g.axis_v = glm::cross(n, g.axis_u);
}

bool same_plane(const PlaneGroup& g, const LocalTriangle& t, double tolerance_m) {
  if (g.material != t.material || glm::dot(g.normal, t.normal) < 1.0 - kNormalTolerance)
    return false;
  return std::ranges::all_of(
      t.corner, [&](const glm::dvec3& p) { return std::abs(glm::dot(p - g.point, g.normal)) <= tolerance_m; });
}

/// Segment in which a triangle meets the group's plane, if any.
std::optional<std::array<glm::dvec2, 2>> contact(const PlaneGroup& g, const LocalTriangle& t, double tolerance_m) {
  std::array<double, 3> h;
  for (int k = 0; k < 3; ++k) {
    h[k] = glm::dot(t.corner[k] - g.point, g.normal);
    if (std::abs(h[k]) <= tolerance_m)
      h[k] = 0.0;
  }
  std::array<glm::dvec2, 4> hit;
  int hits = 0;
  for (int k = 0; k < 3; ++k) {
    const int n = (k + 1) % 3;
    if (h[k] == 0.0)
      hit[hits++] = g.flatten(t.corner[k]);
    else if (h[k] * h[n] < 0.0)
      hit[hits++] = g.flatten(glm::mix(t.corner[k], t.corner[n], h[k] / (h[k] - h[n])));
  }
  if (hits != 2) // apart, one touching corner, or lying in the plane
    return std::nullopt;
  return std::array<glm::dvec2, 2>{hit[0], hit[1]};
}

} // namespace

glm::dvec2 PlaneGroup::flatten(const glm::dvec3& p) const {
  return {glm::dot(p - point, axis_u), glm::dot(p - point, axis_v)};
}

std::vector<PlaneGroup> group_planes(const Room& room, const glm::dvec3& origin) {
  const glm::dvec3 size = room.bounds().size();
  const double tolerance_m = kOffsetTolerance * std::max({size.x, size.y, size.z});
  std::vector<LocalTriangle> triangles;
  for (const RoomTriangle& t : room.triangles) {
    if (room.is_window(t))
      continue;
    triangles.push_back({{room.corner(t, 0) - origin, room.corner(t, 1) - origin, room.corner(t, 2) - origin},
                         glm::normalize(area_normal(room, t)),
                         t.material});
  }
  std::vector<PlaneGroup> groups;
  std::vector<std::size_t> group_of(triangles.size());
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const LocalTriangle& t = triangles[i];
    auto found = std::ranges::find_if(groups, [&](const PlaneGroup& g) { return same_plane(g, t, tolerance_m); });
    if (found == groups.end()) {
      PlaneGroup g;
      g.point = t.corner[0];
      g.normal = t.normal;
      g.material = t.material;
      set_axes(g);
      groups.push_back(std::move(g));
      found = groups.end() - 1;
    }
    group_of[i] = static_cast<std::size_t>(found - groups.begin());
    found->triangles.push_back({found->flatten(t.corner[0]), found->flatten(t.corner[1]), found->flatten(t.corner[2])});
  }
  for (std::size_t g = 0; g < groups.size(); ++g)
    for (std::size_t i = 0; i < triangles.size(); ++i)
      if (group_of[i] != g)
        if (const auto segment = contact(groups[g], triangles[i], tolerance_m))
          groups[g].contacts.push_back(*segment);
  return groups;
}

} // namespace daylit::radiosity
