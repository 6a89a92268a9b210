#include "scene/room/edge_graph.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace daylit::detail {

std::uint32_t PointIndex::add(const glm::dvec3& p) {
  const glm::dvec3 cell = glm::floor(p / (2.0 * tolerance_));
  for (int k = 0; k < 27; ++k) {
    const auto [begin, end] = cells_.equal_range(cell + glm::dvec3(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1));
    for (auto it = begin; it != end; ++it)
      if (glm::distance(points[it->second], p) <= tolerance_)
        return it->second;
  }
  const auto index = static_cast<std::uint32_t>(points.size());
  points.push_back(p);
  cells_.emplace(cell, index);
  return index;
}

Neighbours neighbours_of(const std::vector<Edge>& edges) {
  Neighbours result;
  for (const auto& [a, b] : edges) {
    result[a].push_back(b);
    result[b].push_back(a);
  }
  return result;
}

namespace {

void remove_dead_ends(Neighbours& graph) {
  std::vector<std::uint32_t> ends;
  for (const auto& [v, list] : graph)
    if (list.size() == 1)
      ends.push_back(v);
  while (!ends.empty()) {
    const std::uint32_t v = ends.back();
    ends.pop_back();
    if (graph[v].size() != 1)
      continue;
    const std::uint32_t w = graph[v][0];
    graph[v].clear();
    std::erase(graph[w], v);
    if (graph[w].size() == 1)
      ends.push_back(w);
  }
}

} // namespace

// From u to v go on along the next edge clockwise: the face stays on the left.
std::vector<Outline> faces(const std::vector<glm::dvec3>& points, const std::vector<Edge>& edges,
                           const PlaneFrame& plane) {
  Neighbours graph = neighbours_of(edges);
  remove_dead_ends(graph);
  const auto angle = [&](std::uint32_t from, std::uint32_t to) {
    const glm::dvec2 d = plane.to_plane(points[to]) - plane.to_plane(points[from]);
    return std::atan2(d.y, d.x);
  };
  for (auto& [v, list] : graph)
    std::sort(list.begin(), list.end(), [&, v = v](auto a, auto b) { return angle(v, a) < angle(v, b); });
  std::set<Edge> walked; // directed
  std::vector<Outline> found;
  for (const auto& [start, list] : graph)
    for (const std::uint32_t second : list) {
      Outline face{{}, plane.n};
      std::uint32_t u = start, v = second;
      while (walked.insert({u, v}).second) {
        face.corners.push_back(points[u]);
        const std::vector<std::uint32_t>& around = graph[v];
        const auto back = std::find(around.begin(), around.end(), u);
        const std::uint32_t next = back == around.begin() ? around.back() : *(back - 1);
        u = v;
        v = next;
      }
      if (face.corners.size() >= 3 && glm::dot(newell_normal(face.corners), plane.n) > 0.0)
        found.push_back(std::move(face));
    }
  return found;
}

} // namespace daylit::detail
