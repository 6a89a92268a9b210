#include "scene/placing/standing.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <ranges>
#include <vector>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/vec2.hpp>

#include "scene/core/parallel.h"
#include "scene/core/segment.h"
#include "scene/model/mesh_edges.h"

namespace daylit {

namespace {

constexpr double kContact_m = 1e-3, kContactPart = 2e-3;
constexpr double kEdgePart = 1.0 / 64; // of an object's width: from point to point of an edge that it stands on

double cross(const glm::dvec2& a, const glm::dvec2& b) { return a.x * b.y - a.y * b.x; }

/// Convex hull, counter-clockwise (Andrew 1979).
std::vector<glm::dvec2> convex_hull(std::vector<glm::dvec2> p) {
  std::ranges::sort(p, [](const auto& a, const auto& b) { return a.x != b.x ? a.x < b.x : a.y < b.y; });
  p.erase(std::unique(p.begin(), p.end()), p.end());
  if (p.size() < 3)
    return p;
  std::vector<glm::dvec2> hull;
  for (int half = 0; half < 2; ++half) {
    const std::size_t first = hull.size();
    for (const glm::dvec2& q : p) {
      while (hull.size() >= first + 2 && cross(hull.back() - hull[hull.size() - 2], q - hull.back()) <= 0.0)
        hull.pop_back();
      hull.push_back(q);
    }
    hull.pop_back();
    std::ranges::reverse(p);
  }
  return hull;
}

/// 0 inside of a convex, counter-clockwise polygon; of a point or a segment too.
double distance_outside(const glm::dvec2& p, const std::vector<glm::dvec2>& hull) {
  bool inside = hull.size() > 2;
  double nearest = glm::length(p - hull.front());
  for (std::size_t k = 0; k < hull.size(); ++k) {
    const glm::dvec2 &a = hull[k], &b = hull[(k + 1) % hull.size()];
    inside = inside && cross(b - a, p - a) >= 0.0;
    nearest = std::min(nearest, distance_to_segment(p, a, b));
  }
  return inside ? 0.0 : nearest;
}

std::vector<glm::dvec3> placed(const ObjectMesh& mesh, const glm::dmat4& world_from_object) {
  std::vector<glm::dvec3> world;
  for (const glm::vec3& p : mesh.positions)
    world.emplace_back(world_from_object * glm::dvec4(glm::dvec3(p), 1.0));
  return world;
}

/// First surface that a segment crosses.
std::optional<RayHit> crossing(const RayScene& rays, const glm::dvec3& a, const glm::dvec3& b) {
  RayHit hit;
  if (!rays.closest(rays.to_local(a), glm::vec3(b - a), 0.0f, 1.0f, hit))
    return std::nullopt;
  return hit;
}

/// Edges of the object through faces of the room. The lowest such triangle of the object, whatever the threads do.
void find_object_edges(const ObjectMesh& mesh, const std::vector<glm::dvec3>& at, const Room& room,
                       const RayScene& rays, Standing& out) {
  std::mutex mutex;
  std::size_t first = mesh.triangles.size();
  parallel_for(tbb::blocked_range<std::size_t>(0, mesh.triangles.size(), 256), [&](const auto& range) {
    for (std::size_t t = range.begin(); t != range.end(); ++t)
      for (std::size_t k = 0; k < 3; ++k) {
        const glm::dvec3 &a = at[mesh.triangles[t][k]], &b = at[mesh.triangles[t][(k + 1) % 3]];
        const auto hit = crossing(rays, a, b);
        if (!hit)
          continue;
        const std::lock_guard lock(mutex);
        if (t >= first)
          continue;
        first = t;
        out.cut = a + static_cast<double>(hit->distance) * (b - a);
        out.cut_by = room.material(room.triangles[hit->triangle]).name;
      }
  });
}

/// Edges of the room through faces of the object, whose rays are in its own frame.
void find_room_edges(const ObjectMesh& mesh, const glm::dmat4& world_from_object, const Room& room, Standing& out) {
  const std::vector<glm::dvec3> own(mesh.positions.begin(), mesh.positions.end());
  const auto rays = RayScene::build(own, mesh.triangles);
  if (!rays)
    return;
  const glm::dmat4 object_from_world = glm::inverse(world_from_object);
  for (const RoomTriangle& t : room.triangles)
    for (int k = 0; k < 3 && !out.cut; ++k) {
      const glm::dvec3 a = room.corner(t, k), b = room.corner(t, (k + 1) % 3);
      const auto hit = crossing(*rays, glm::dvec3(object_from_world * glm::dvec4(a, 1.0)),
                                glm::dvec3(object_from_world * glm::dvec4(b, 1.0)));
      if (!hit || room.is_window(t))
        continue;
      out.cut = a + static_cast<double>(hit->distance) * (b - a);
      out.cut_by = room.material(t).name;
    }
}

/// Horizontal places of the lowest points that have the room right below them: corners, and points of edges between
/// two low ones, of which a part may reach beyond the edge of a table.
std::vector<glm::dvec2> contact_points(const ObjectMesh& mesh, const std::vector<glm::dvec3>& at, const Bounds& box,
                                       const RayScene& rays) {
  const double near = std::max(kContact_m, kContactPart * box.size().z),
               step = kEdgePart * std::max(box.size().x, box.size().y);
  std::vector<glm::dvec2> contact;
  const auto look = [&](const glm::dvec3& p) {
    if (crossing(rays, p + glm::dvec3(0, 0, near), p - glm::dvec3(0, 0, 2.0 * near)))
      contact.emplace_back(p);
  };
  const auto is_low = [&](const glm::dvec3& p) { return p.z < box.min.z + near; };
  std::ranges::for_each(at | std::views::filter(is_low), look);
  for (const auto& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const glm::dvec3 &a = at[t[k]], &b = at[t[(k + 1) % 3]];
      const double length = is_low(a) && is_low(b) ? glm::length(b - a) : 0.0;
      for (double along = step; along < length; along += step)
        look(a + along / length * (b - a));
    }
  return contact;
}

} // namespace

/// Closed: sum of the tetrahedra from one point to each face, weighted by their signed volumes; open: of the faces,
/// weighted by their areas.
MeshWeight weigh(const ObjectMesh& mesh) {
  const bool closed = is_balanced(edge_balance(mesh, position_numbers(mesh)));
  const glm::dvec3 origin = mesh.positions.empty() ? glm::dvec3(0.0) : glm::dvec3(mesh.positions[0]);
  glm::dvec3 sum(0.0);
  double weight = 0.0;
  for (const auto& t : mesh.triangles) {
    const glm::dvec3 a = glm::dvec3(mesh.positions[t[0]]) - origin, b = glm::dvec3(mesh.positions[t[1]]) - origin,
                     c = glm::dvec3(mesh.positions[t[2]]) - origin;
    const double w = closed ? glm::dot(a, glm::cross(b, c)) : glm::length(glm::cross(b - a, c - a));
    sum += w * (a + b + c) / (closed ? 4.0 : 3.0);
    weight += w;
  }
  return {weight != 0.0 ? origin + sum / weight : origin, closed};
}

Bounds placed_bounds(const ObjectMesh& mesh, const glm::dmat4& world_from_object) {
  Bounds box;
  for (const glm::vec3& p : mesh.positions)
    box.include(glm::dvec3(world_from_object * glm::dvec4(glm::dvec3(p), 1.0)));
  return box;
}

Standing check_standing(const WeighedMesh& object, const glm::dmat4& world_from_object, const Room& room,
                        const RayScene& rays) {
  const ObjectMesh& mesh = object.mesh;
  Standing out;
  std::vector<glm::dvec3> at = placed(mesh, world_from_object);
  if (at.empty())
    return out;
  const Bounds box = placed_bounds(mesh, world_from_object);
  const std::vector<glm::dvec2> contact = contact_points(mesh, at, box, rays);
  const glm::dvec3 mass(world_from_object * glm::dvec4(object.weight.centre_of_mass, 1.0));
  out.supported = !contact.empty();
  if (out.supported)
    out.beyond_m = distance_outside(glm::dvec2(mass), convex_hull(contact));
  // What it stands on must not count: it is lifted a little.
  const glm::dvec3 lift(0, 0, std::max(kContact_m, kContactPart * box.size().z));
  for (glm::dvec3& p : at)
    p += lift;
  find_object_edges(mesh, at, room, rays, out);
  glm::dmat4 lifted = world_from_object;
  lifted[3] += glm::dvec4(lift, 0.0);
  if (!out.cut)
    find_room_edges(mesh, lifted, room, out);
  return out;
}

std::vector<std::string> standing_warnings(const std::string& name, const Standing& s, double size_m) {
  std::vector<std::string> lines;
  if (!s.supported)
    lines.push_back(name + " stands on nothing: no surface is right below its lowest points; move it or turn it");
  else if (s.tips(size_m))
    lines.push_back(fmt::format("{} would tip over: its centre of mass lies {:.1f} cm beside the points it stands on; "
                                "move it or turn it",
                                name, 100.0 * s.beyond_m));
  if (s.cut)
    lines.push_back(
        fmt::format("{} intersects the room: \"{}\" cuts through it at ({:.2f}, {:.2f}, {:.2f}); move it or "
                    "scale it",
                    name, s.cut_by, s.cut->x, s.cut->y, s.cut->z));
  return lines;
}

} // namespace daylit
