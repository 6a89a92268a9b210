#pragma once

// Graphs of edges between welded points, and the planar faces they bound.

#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include <glm/vec3.hpp>

#include "scene/room/outlines.h"
#include "scene/room/polygon.h"

namespace daylit::detail {

constexpr double kWeldTolerance = 1e-6; // of the room's size: vertices closer than this are one

using Edge = std::pair<std::uint32_t, std::uint32_t>; ///< smaller index first
inline Edge edge_of(std::uint32_t a, std::uint32_t b) { return a < b ? Edge{a, b} : Edge{b, a}; }

struct LessByCoordinates {
  bool operator()(const glm::dvec3& a, const glm::dvec3& b) const {
    return a.x != b.x ? a.x < b.x : a.y != b.y ? a.y < b.y : a.z < b.z;
  }
};

/// Indices of points; positions within the tolerance (m) are one point.
class PointIndex {
public:
  explicit PointIndex(double tolerance) : tolerance_(tolerance) {}
  std::uint32_t add(const glm::dvec3& p);
  std::vector<glm::dvec3> points;

private:
  double tolerance_;
  std::multimap<glm::dvec3, std::uint32_t, LessByCoordinates> cells_;
};

struct EdgeGraph {
  std::vector<glm::dvec3> points;
  std::vector<Edge> edges;
};

using Neighbours = std::map<std::uint32_t, std::vector<std::uint32_t>>;
Neighbours neighbours_of(const std::vector<Edge>& edges);

/// Vertices closer than this are one, metres.
double weld_tolerance_m(const Room& room);
/// Edges of the room's surfaces, windows included, welded and cut where another point lies on them. Empty: there are
/// more than 50,000.
std::optional<EdgeGraph> border_graph(const Room& room, BorderKind kind);

/// Bounded faces of the edges, all in `plane`; edges that bound no face on both their sides are left out.
std::vector<Outline> faces(const std::vector<glm::dvec3>& points, const std::vector<Edge>& edges,
                           const PlaneFrame& plane);

} // namespace daylit::detail
