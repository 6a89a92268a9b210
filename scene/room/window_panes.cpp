#include "scene/room/outlines.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include <glm/geometric.hpp>

#include "scene/room/edge_graph.h"
#include "scene/room/polygon.h"

namespace daylit::detail {

namespace {

constexpr std::size_t kMostMerged = 512; // joining is quadratic; more parts stay as they are

using Polygon = std::vector<std::uint32_t>;

/// The union of two polygons across a shared edge, when it is convex.
std::optional<Polygon> joined(const Polygon& a, const Polygon& b, const std::vector<glm::dvec3>& points,
                              const glm::dvec3& normal) {
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t j = 0; j < b.size(); ++j) {
      if (a[i] != b[(j + 1) % b.size()] || a[(i + 1) % a.size()] != b[j])
        continue;
      Polygon both;
      for (std::size_t k = 1; k <= a.size(); ++k)
        both.push_back(a[(i + k) % a.size()]);
      for (std::size_t k = 2; k < b.size(); ++k)
        both.push_back(b[(j + k) % b.size()]);
      std::vector<glm::dvec3> corners;
      for (const std::uint32_t v : both)
        corners.push_back(points[v]);
      if (is_convex(corners, normal))
        return both;
      return std::nullopt;
    }
  return std::nullopt;
}

/// Joins convex polygons across shared edges until none can be joined (Hertel & Mehlhorn 1983, greedy).
void join_convex(std::vector<Polygon>& polygons, const std::vector<glm::dvec3>& points, const glm::dvec3& normal) {
  if (polygons.size() > kMostMerged)
    return;
  for (std::size_t i = 0; i < polygons.size(); ++i)
    for (std::size_t j = i + 1; j < polygons.size();) {
      std::optional<Polygon> both = joined(polygons[i], polygons[j], points, normal);
      if (!both) {
        ++j;
        continue;
      }
      polygons[i] = std::move(*both);
      polygons.erase(polygons.begin() + static_cast<std::ptrdiff_t>(j));
      j = i + 1;
    }
}

std::vector<Outline> to_outlines(const std::vector<Polygon>& polygons, const std::vector<glm::dvec3>& points,
                                 const glm::dvec3& normal) {
  std::vector<Outline> outlines;
  for (const Polygon& polygon : polygons) {
    Outline outline{{}, normal};
    for (const std::uint32_t v : polygon)
      outline.corners.push_back(points[v]);
    outline.corners = without_straight_corners(outline.corners, kWeldTolerance * extent(outline.corners));
    outlines.push_back(std::move(outline));
  }
  return outlines;
}

/// One flat group of window triangles of one material.
struct PaneGroup {
  PlaneFrame plane;
  std::uint32_t material = 0;
  std::vector<Polygon> triangles; // counter-clockwise about plane.n, indices into the welded points
};

std::vector<PaneGroup> pane_groups(const Room& room, PointIndex& index) {
  std::vector<PaneGroup> groups;
  std::map<std::pair<Edge, std::uint32_t>, std::vector<std::uint32_t>> on_edge; // (edge, material) -> triangles
  std::vector<Polygon> polygon;
  std::vector<std::uint32_t> material;
  for (const RoomTriangle& t : room.triangles) {
    if (!room.is_window(t))
      continue;
    const auto id = static_cast<std::uint32_t>(polygon.size());
    polygon.push_back({index.add(room.corner(t, 0)), index.add(room.corner(t, 1)), index.add(room.corner(t, 2))});
    material.push_back(t.material);
    for (int k = 0; k < 3; ++k)
      on_edge[{edge_of(polygon[id][k], polygon[id][(k + 1) % 3]), t.material}].push_back(id);
  }
  std::vector<bool> taken(polygon.size(), false);
  const auto normal_of = [&](const Polygon& t) {
    return glm::cross(index.points[t[1]] - index.points[t[0]], index.points[t[2]] - index.points[t[0]]);
  };
  for (std::uint32_t seed = 0; seed < polygon.size(); ++seed) {
    const double area = glm::length(normal_of(polygon[seed]));
    if (taken[seed] || !(area > 0.0))
      continue;
    PaneGroup group{
        PlaneFrame::make(index.points[polygon[seed][0]], normal_of(polygon[seed]) / area), material[seed], {}};
    std::vector<std::uint32_t> open{seed};
    taken[seed] = true;
    while (!open.empty()) {
      Polygon t = polygon[open.back()];
      open.pop_back();
      if (glm::dot(normal_of(t), group.plane.n) < 0.0)
        std::swap(t[1], t[2]);
      group.triangles.push_back(t);
      for (int k = 0; k < 3; ++k)
        for (const std::uint32_t other : on_edge[{edge_of(t[k], t[(k + 1) % 3]), group.material}]) {
          const double length = glm::length(normal_of(polygon[other]));
          if (taken[other] || std::abs(glm::dot(normal_of(polygon[other]), group.plane.n)) < (1.0 - 1e-7) * length)
            continue;
          taken[other] = true;
          open.push_back(other);
        }
    }
    groups.push_back(std::move(group));
  }
  return groups;
}

/// The group as one convex outline when it is one, else as joined triangles.
std::vector<Outline> parts_of(const PaneGroup& group, const PointIndex& index) {
  std::map<Edge, int> uses;
  double area = 0.0;
  for (const Polygon& t : group.triangles) {
    area += glm::length(glm::cross(index.points[t[1]] - index.points[t[0]], index.points[t[2]] - index.points[t[0]]));
    for (int k = 0; k < 3; ++k)
      ++uses[edge_of(t[k], t[(k + 1) % 3])];
  }
  std::vector<Edge> border;
  for (const auto& [edge, n] : uses)
    if (n % 2 == 1)
      border.push_back(edge);
  std::vector<Outline> loops = faces(index.points, border, group.plane);
  if (loops.size() == 1 && std::abs(glm::length(newell_normal(loops[0].corners)) - area) < 1e-6 * area)
    return convex_parts(loops[0]);
  std::vector<Polygon> polygons = group.triangles;
  join_convex(polygons, index.points, group.plane.n);
  return to_outlines(polygons, index.points, group.plane.n);
}

} // namespace

std::vector<Pane> window_panes(const Room& room) {
  const glm::dvec3 size = room.bounds().size();
  PointIndex index(kWeldTolerance * std::max({size.x, size.y, size.z}));
  std::vector<Pane> panes;
  for (const PaneGroup& group : pane_groups(room, index))
    for (Outline& part : parts_of(group, index))
      panes.push_back({std::move(part), group.material});
  return panes;
}

std::vector<Outline> convex_parts(const Outline& outline) {
  const std::vector<glm::dvec3> corners =
      without_straight_corners(outline.corners, kWeldTolerance * extent(outline.corners));
  if (is_convex(corners, outline.normal))
    return {{corners, outline.normal}};
  const std::optional<TriangleList> triangles = triangulate(corners);
  if (!triangles)
    return {};
  std::vector<Polygon> polygons;
  for (const auto& t : *triangles)
    polygons.push_back({t.begin(), t.end()});
  join_convex(polygons, corners, outline.normal);
  return to_outlines(polygons, corners, outline.normal);
}

} // namespace daylit::detail
