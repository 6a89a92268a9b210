#include "radiosity/detail/near_edges.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "scene/core/parallel.h"

namespace daylit::radiosity {

namespace {

// Of the edges of facets.
constexpr double kNear = 0.25;
constexpr double kLong = 1.0;
constexpr double kThere = 1.0 / 16;

using Edge = std::array<glm::dvec3, 2>;
using Line = std::array<glm::dvec2, 2>;

/// Sides that one triangle has, not two.
std::vector<Line> border(const PlaneGroup& g) {
  const auto less = [](const Line& a, const Line& b) {
    return std::array{a[0].x, a[0].y, a[1].x, a[1].y} < std::array{b[0].x, b[0].y, b[1].x, b[1].y};
  };
  std::map<Line, int, decltype(less)> times(less);
  for (const auto& t : g.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      Line side{t[k], t[(k + 1) % 3]};
      if (less({side[1], side[0]}, side))
        std::swap(side[0], side[1]);
      ++times[side];
    }
  std::vector<Line> lines;
  for (const auto& [side, count] : times)
    if (count == 1)
      lines.push_back(side);
  return lines;
}

/// A triangle by itself is a part of a curved surface.
bool is_flat_face(const PlaneGroup& g) { return g.triangles.size() > 1; }

double distance(const glm::dvec2& p, const Line& line) {
  const glm::dvec2 along = line[1] - line[0];
  const double t = glm::dot(p - line[0], along) / std::max(glm::dot(along, along), 1e-30);
  return glm::distance(p, line[0] + std::clamp(t, 0.0, 1.0) * along);
}

/// Low and high corner of a group in its plane.
std::array<glm::dvec2, 2> bounds(const PlaneGroup& g) {
  std::array<glm::dvec2, 2> box{g.triangles[0][0], g.triangles[0][0]};
  for (const auto& t : g.triangles)
    for (const glm::dvec2& p : t)
      box = {glm::min(box[0], p), glm::max(box[1], p)};
  return box;
}

bool meets(const std::array<glm::dvec2, 2>& box, const Line& line) {
  const glm::dvec2 low = glm::min(line[0], line[1]), high = glm::max(line[0], line[1]);
  return low.x < box[1].x && low.y < box[1].y && high.x > box[0].x && high.y > box[0].y;
}

void add_to(PlaneGroup& g, std::vector<Line> there, const std::vector<Edge>& edges, double near_m, double edge_m) {
  const auto is_near = [&](const glm::dvec3& p) { return std::abs(glm::dot(p - g.point, g.normal)) <= near_m; };
  const auto is_there = [&](const Line& line) {
    return std::ranges::any_of(there, [&](const Line& t) {
      return distance(line[0], t) <= kThere * edge_m && distance(line[1], t) <= kThere * edge_m;
    });
  };
  there.insert(there.end(), g.contacts.begin(), g.contacts.end());
  const auto box = bounds(g);
  for (const Edge& e : edges) {
    if (!is_near(e[0]) || !is_near(e[1]))
      continue;
    const Line line{g.flatten(e[0]), g.flatten(e[1])};
    if (!meets(box, line) || is_there(line))
      continue;
    there.push_back(line);
    g.contacts.push_back(line);
  }
}

} // namespace

void add_near_edges(std::vector<PlaneGroup>& groups, double near_m, double edge_m) {
  std::vector<std::vector<Line>> borders(groups.size());
  parallel_for(std::size_t{0}, groups.size(), [&](std::size_t i) { borders[i] = border(groups[i]); });
  std::vector<Edge> edges;
  for (std::size_t i = 0; i < groups.size(); ++i)
    for (const Line& line : borders[i])
      if (is_flat_face(groups[i]) && glm::distance(line[0], line[1]) >= kLong * edge_m)
        edges.push_back({groups[i].lift(line[0]), groups[i].lift(line[1])});
  parallel_for(std::size_t{0}, groups.size(), [&](std::size_t i) {
    if (is_flat_face(groups[i]))
      add_to(groups[i], borders[i], edges, std::min(near_m, kNear * edge_m), edge_m);
  });
}

} // namespace daylit::radiosity
