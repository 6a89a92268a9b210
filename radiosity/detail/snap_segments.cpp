#include "radiosity/detail/snap_segments.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <set>
#include <unordered_map>
#include <utility>

#include <glm/geometric.hpp>

namespace daylit::radiosity {

namespace {

/// Points closer than the tolerance share an index; looked up through a grid of cells twice as wide.
class PointSet {
public:
  explicit PointSet(double tolerance) : tolerance_(tolerance), cell_(2.0 * tolerance) {}

  int insert(const glm::dvec2& p) {
    const auto cx = static_cast<std::int64_t>(std::floor(p.x / cell_));
    const auto cy = static_cast<std::int64_t>(std::floor(p.y / cell_));
    for (std::int64_t dx = -1; dx <= 1; ++dx)
      for (std::int64_t dy = -1; dy <= 1; ++dy) {
        const auto range = cells_.equal_range(key(cx + dx, cy + dy));
        for (auto it = range.first; it != range.second; ++it)
          if (glm::distance(points[it->second], p) <= tolerance_)
            return it->second;
      }
    points.push_back(p);
    cells_.emplace(key(cx, cy), static_cast<int>(points.size() - 1));
    return static_cast<int>(points.size() - 1);
  }

  std::vector<glm::dvec2> points;

private:
  static std::uint64_t key(std::int64_t x, std::int64_t y) {
    return static_cast<std::uint64_t>(x) * 0x9E3779B97F4A7C15ull ^ static_cast<std::uint64_t>(y);
  }
  double tolerance_, cell_;
  std::unordered_multimap<std::uint64_t, int> cells_;
};

/// Finds the points near a segment: sorted along both axes, the one on which the segment is shorter is searched.
class PointsOnSegment {
public:
  PointsOnSegment(const std::vector<glm::dvec2>& points, double tolerance) : points_(points), tolerance_(tolerance) {
    for (int axis = 0; axis < 2; ++axis) {
      for (int i = 0; i < static_cast<int>(points.size()); ++i)
        along_[axis].emplace_back(points[i][axis], i);
      std::ranges::sort(along_[axis]);
    }
  }

  /// Indices of the points on the segment a-b, ends included, in order from a to b.
  std::vector<int> chain(int a, int b) const {
    const glm::dvec2 from = points_[a], direction = points_[b] - from;
    const double length = glm::length(direction);
    const glm::dvec2 u = direction / length;
    std::vector<std::pair<double, int>> order = {{0.0, a}, {length, b}};
    const auto [first, last] = range_in(count_in(0, a, b) <= count_in(1, a, b) ? 0 : 1, a, b);
    for (auto it = first; it != last; ++it) {
      const int i = it->second;
      if (i == a || i == b)
        continue;
      const glm::dvec2 d = points_[i] - from;
      const double along = glm::dot(d, u), off = std::abs(d.x * u.y - d.y * u.x);
      if (off <= tolerance_ && along > 0.0 && along < length)
        order.emplace_back(along, i);
    }
    std::ranges::sort(order);
    std::vector<int> chain;
    for (const auto& [along, i] : order)
      chain.push_back(i);
    return chain;
  }

private:
  using Sorted = std::vector<std::pair<double, int>>;
  std::pair<Sorted::const_iterator, Sorted::const_iterator> range_in(int axis, int a, int b) const {
    const double low = std::min(points_[a][axis], points_[b][axis]),
                 high = std::max(points_[a][axis], points_[b][axis]);
    const Sorted& s = along_[axis];
    return {std::ranges::lower_bound(s, std::pair(low - tolerance_, -1)),
            std::ranges::upper_bound(s, std::pair(high + tolerance_, static_cast<int>(points_.size())))};
  }
  std::ptrdiff_t count_in(int axis, int a, int b) const {
    const auto [first, last] = range_in(axis, a, b);
    return last - first;
  }

  const std::vector<glm::dvec2>& points_;
  double tolerance_;
  std::array<Sorted, 2> along_;
};

} // namespace

/// Join near points, split at points that lie on a segment, drop what became equal or empty.
std::vector<Segment2> snap_segments(const std::vector<Segment2>& segments, double tolerance_m) {
  PointSet set(tolerance_m);
  std::vector<std::pair<int, int>> edges;
  for (const Segment2& s : segments) {
    const int a = set.insert(s[0]), b = set.insert(s[1]);
    if (a != b)
      edges.emplace_back(a, b);
  }
  const PointsOnSegment on_segment(set.points, tolerance_m);
  std::set<std::pair<int, int>> pieces;
  for (const auto& [a, b] : edges) {
    const std::vector<int> chain = on_segment.chain(a, b);
    for (std::size_t k = 0; k + 1 < chain.size(); ++k)
      pieces.insert(std::minmax(chain[k], chain[k + 1]));
  }
  std::vector<Segment2> result;
  for (const auto& [a, b] : pieces)
    result.push_back({set.points[a], set.points[b]});
  return result;
}

} // namespace daylit::radiosity
