#include "scene/room/outlines.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>

#include <glm/geometric.hpp>

#include "scene/room/edge_graph.h"
#include "scene/room/polygon.h"

namespace daylit::detail {

namespace {

constexpr double kPlaneTolerance = 1e-4; // of the loop's size: how far from flat a hole may be
constexpr std::size_t kMostComponentEdges = 4096, kMostDegree = 16;
constexpr double kStraightSine = 1e-3; // two edges this close to one line do not define a plane

/// Groups of edges connected through their ends.
std::vector<std::vector<Edge>> components(const EdgeGraph& graph) {
  std::vector<std::uint32_t> parent(graph.points.size());
  std::iota(parent.begin(), parent.end(), 0u);
  const auto root = [&parent](std::uint32_t i) {
    while (parent[i] != i)
      i = parent[i] = parent[parent[i]];
    return i;
  };
  for (const auto& [a, b] : graph.edges)
    parent[root(a)] = root(b);
  std::map<std::uint32_t, std::vector<Edge>> groups;
  for (const Edge& e : graph.edges)
    groups[root(e.first)].push_back(e);
  std::vector<std::vector<Edge>> result;
  for (auto& [_, edges] : groups)
    result.push_back(std::move(edges));
  return result;
}

/// Every plane through two edges that meet, once.
std::vector<PlaneFrame> planes_of(const EdgeGraph& graph, const std::vector<Edge>& edges, double tolerance) {
  std::vector<PlaneFrame> planes;
  for (const auto& [v, list] : neighbours_of(edges))
    for (std::size_t i = 0; i < std::min(list.size(), kMostDegree); ++i)
      for (std::size_t j = 0; j < i; ++j) {
        const glm::dvec3 o = graph.points[v], a = graph.points[list[i]] - o, b = graph.points[list[j]] - o;
        const glm::dvec3 n = glm::cross(a, b);
        const double length = glm::length(n);
        if (length <= kStraightSine * glm::length(a) * glm::length(b))
          continue;
        const bool known = std::any_of(planes.begin(), planes.end(), [&](const PlaneFrame& p) {
          return std::abs(p.height(o)) <= tolerance && std::abs(p.height(o + a)) <= tolerance &&
                 std::abs(p.height(o + b)) <= tolerance;
        });
        if (!known)
          planes.push_back(PlaneFrame::make(o, n / length));
      }
  return planes;
}

std::vector<Outline> planar_loops(const EdgeGraph& graph, const std::vector<Edge>& component) {
  Bounds bounds;
  for (const auto& [a, b] : component) {
    bounds.include(graph.points[a]);
    bounds.include(graph.points[b]);
  }
  const glm::dvec3 size = bounds.size();
  const double tolerance = kPlaneTolerance * std::max({size.x, size.y, size.z});
  std::vector<Outline> loops;
  for (const PlaneFrame& plane : planes_of(graph, component, tolerance)) {
    std::vector<Edge> flat;
    for (const Edge& e : component)
      if (std::abs(plane.height(graph.points[e.first])) <= tolerance &&
          std::abs(plane.height(graph.points[e.second])) <= tolerance)
        flat.push_back(e);
    for (Outline& loop : faces(graph.points, flat, plane))
      loops.push_back(std::move(loop));
  }
  return loops;
}

} // namespace

HoleOutlines hole_outlines(const Room& room, BorderKind kind) {
  HoleOutlines result;
  const std::optional<EdgeGraph> graph = border_graph(room, kind);
  if (!graph) {
    result.complete = false;
    return result;
  }
  for (const std::vector<Edge>& component : components(*graph)) {
    if (component.size() > kMostComponentEdges) {
      result.complete = false;
      continue;
    }
    for (Outline& loop : planar_loops(*graph, component))
      result.outlines.push_back(std::move(loop));
  }
  return result;
}

} // namespace daylit::detail
