#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include <glm/geometric.hpp>

#include "scene/room/edge_graph.h"

namespace daylit::detail {

namespace {

constexpr std::size_t kMostEdges = 50000;
constexpr double kCreaseCosine = 0.9999; // surfaces that bend less than 0.8 degrees are one

/// Edges that bound a surface, or bend it, in exact coordinates; endpoints index room.vertices.
std::vector<Edge> border_edges(const Room& room, BorderKind kind) {
  std::map<glm::dvec3, std::uint32_t, LessByCoordinates> first;
  std::vector<std::uint32_t> same(room.vertices.size());
  for (std::uint32_t i = 0; i < same.size(); ++i)
    same[i] = first.try_emplace(room.vertices[i], i).first->second;
  std::vector<std::pair<Edge, std::uint32_t>> uses;
  for (std::uint32_t t = 0; t < room.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k)
      uses.push_back({edge_of(same[room.triangles[t].vertex[k]], same[room.triangles[t].vertex[(k + 1) % 3]]), t});
  std::sort(uses.begin(), uses.end());
  std::vector<Edge> borders;
  for (std::size_t i = 0, end = 0; i < uses.size(); i = end) {
    while (end < uses.size() && uses[end].first == uses[i].first)
      ++end;
    bool border = (end - i) % 2 == 1;
    if (kind == BorderKind::crease && end - i == 2) {
      const glm::dvec3 a = area_normal(room, room.triangles[uses[i].second]);
      const glm::dvec3 b = area_normal(room, room.triangles[uses[i + 1].second]);
      border = std::abs(glm::dot(a, b)) < kCreaseCosine * glm::length(a) * glm::length(b);
    }
    if (border)
      borders.push_back(uses[i].first);
  }
  return borders;
}

/// The edges welded, and cut where another point lies on them; an open edge that comes up an even number of times
/// joins two surfaces and vanishes. What remains of the open edges is closed loops.
EdgeGraph resolve(const Room& room, const std::vector<Edge>& borders, double tolerance, BorderKind kind) {
  PointIndex index(tolerance);
  std::vector<Edge> whole;
  for (const Edge& e : borders)
    whole.push_back({index.add(room.vertices[e.first]), index.add(room.vertices[e.second])});
  const std::vector<glm::dvec3>& p = index.points;
  Bounds bounds;
  for (const glm::dvec3& q : p)
    bounds.include(q);
  const glm::dvec3 size = bounds.size();
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  std::vector<std::uint32_t> order(p.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](auto a, auto b) { return p[a][axis] < p[b][axis]; });
  std::map<Edge, std::size_t> count;
  for (const auto& [a, b] : whole) {
    const double low = std::min(p[a][axis], p[b][axis]) - tolerance,
                 high = std::max(p[a][axis], p[b][axis]) + tolerance;
    auto it = std::lower_bound(order.begin(), order.end(), low, [&](auto i, double x) { return p[i][axis] < x; });
    const double length = glm::distance(p[a], p[b]);
    if (!(length > 0.0))
      continue;
    const glm::dvec3 along = (p[b] - p[a]) / length;
    std::vector<std::pair<double, std::uint32_t>> cuts{{0.0, a}, {length, b}};
    for (; it != order.end() && p[*it][axis] <= high; ++it) {
      const double s = glm::dot(p[*it] - p[a], along);
      if (s > tolerance && s < length - tolerance && glm::distance(p[*it], p[a] + s * along) <= tolerance)
        cuts.push_back({s, *it});
    }
    std::sort(cuts.begin(), cuts.end());
    for (std::size_t k = 0; k + 1 < cuts.size(); ++k)
      ++count[edge_of(cuts[k].second, cuts[k + 1].second)];
  }
  EdgeGraph graph{p, {}};
  for (const auto& [edge, n] : count)
    if (n % 2 == 1 || kind == BorderKind::crease)
      graph.edges.push_back(edge);
  return graph;
}

} // namespace

double weld_tolerance_m(const Room& room) {
  const glm::dvec3 size = room.bounds().size();
  return kWeldTolerance * std::max({size.x, size.y, size.z});
}

std::optional<EdgeGraph> border_graph(const Room& room, BorderKind kind) {
  const std::vector<Edge> borders = border_edges(room, kind);
  if (borders.size() > kMostEdges)
    return std::nullopt;
  return resolve(room, borders, weld_tolerance_m(room), kind);
}

} // namespace daylit::detail
