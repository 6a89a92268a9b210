#include "radiosity/detail/near_holes.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/geometric.hpp>

#include "scene/core/segment.h"

namespace daylit::radiosity {

namespace {

constexpr double kThickest_m = 0.6; // of walls: so far a duct may go on from its outline
constexpr double kBeside = 0.5; // of the edge length: what lies so far off the prism over the outline may be its side
constexpr double kAcross = 0.7; // cosine between the normals of a side and the hole, at most
constexpr double kParallel = 0.999, kInPlane = 0.01,
                 kBeyond = 0.25; // of a wall: cosine, parts of the width of the hole
constexpr double kOfSlit = 0.25; // of its longest extent

bool covers(const PlaneGroup& group, const glm::dvec3& point) {
  const glm::dvec2 p = group.flatten(point);
  const auto left_of = [&](const glm::dvec2& a, const glm::dvec2& b) {
    return (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
  };
  return std::ranges::any_of(group.triangles, [&](const auto& t) {
    const double u = left_of(t[0], t[1]), v = left_of(t[1], t[2]), w = left_of(t[2], t[0]);
    return (u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0);
  });
}

/// Beyond half of its sides or more there is a surface in its plane. `area`: normal of the hole times its area.
bool is_in_wall(const HoleOutline& outline, const glm::dvec3& area, std::span<const PlaneGroup> groups) {
  const double width = std::sqrt(glm::length(area));
  std::size_t walls = 0;
  for (std::size_t k = 0; k < outline.size(); ++k) {
    const glm::dvec3 &a = outline[k], &b = outline[(k + 1) % outline.size()];
    const glm::dvec3 beyond = 0.5 * (a + b) + kBeyond * width * glm::normalize(glm::cross(b - a, area));
    walls += std::ranges::any_of(groups, [&](const PlaneGroup& g) {
      return std::abs(glm::dot(beyond - g.point, g.normal)) < kInPlane * width &&
             std::abs(glm::dot(g.normal, area)) > kParallel * glm::length(area) && covers(g, beyond);
    });
  }
  return 2 * walls >= outline.size();
}

} // namespace

/// 2 A / U, half the width of a square or a circle; A: area, U: perimeter.
NearHoles::NearHoles(std::span<const HoleOutline> holes, std::span<const PlaneGroup> groups) {
  for (const HoleOutline& outline : holes) {
    glm::dvec3 area(0.0);
    double perimeter = 0.0, longest = 0.0;
    for (std::size_t k = 0; k < outline.size(); ++k) {
      const glm::dvec3 &a = outline[k], &b = outline[(k + 1) % outline.size()];
      area += 0.5 * glm::cross(a - outline[0], b - outline[0]);
      perimeter += glm::distance(a, b);
      for (const glm::dvec3& c : outline)
        longest = std::max(longest, glm::distance(a, c));
    }
    if (const double size = glm::length(area); size > 0.0 && is_in_wall(outline, area, groups))
      holes_.push_back({outline, area / size, std::max(2.0 * size / perimeter, kOfSlit * longest)});
  }
}

double NearHoles::edge_m(const glm::dvec3& p, const glm::dvec3& normal) const {
  double edge = std::numeric_limits<double>::infinity();
  for (const Duct& hole : holes_) {
    const double depth = glm::dot(p - hole.outline[0], hole.normal);
    if (std::abs(depth) > kThickest_m || std::abs(glm::dot(normal, hole.normal)) > kAcross)
      continue;
    const glm::dvec3 in_plane = p - depth * hole.normal;
    for (std::size_t k = 0; k < hole.outline.size(); ++k)
      if (distance_to_segment(in_plane, hole.outline[k], hole.outline[(k + 1) % hole.outline.size()]) <=
          kBeside * hole.edge_m)
        edge = std::min(edge, hole.edge_m);
  }
  return edge;
}

} // namespace daylit::radiosity
