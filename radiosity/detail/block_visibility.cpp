#include "radiosity/detail/block_visibility.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <glm/geometric.hpp>

namespace daylit::radiosity {

namespace {
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kPatience = 16;              // obstacles looked at in search of one that hides everything
constexpr std::uint32_t kMostPlanes = 128; // of a curved cluster, looked at one by one
constexpr double kTouchTolerance = 1e-7;   // of the room's size: rounding of coplanar corners

double cross2(double ax, double ay, double bx, double by) { return ax * by - ay * bx; }

/// Sides of the hull of two boxes, seen along one axis: does a tangent line to both keep the obstacle on its far
/// side? (Shaft culling, Haines & Wallace 1991.) u, v: the two remaining axes; `corner` picks lo or hi of each.
bool tangent_separates(const Box& a, const Box& b, const Box& obstacle, int u, int v, int corner, double tolerance) {
  const auto pick = [&](const Box& box, int c, int axis, int bit) { return c & bit ? box.hi[axis] : box.lo[axis]; };
  const double px = pick(a, corner, u, 1), py = pick(a, corner, v, 2);
  const double dx = pick(b, corner, u, 1) - px, dy = pick(b, corner, v, 2) - py;
  const double length = std::sqrt(dx * dx + dy * dy), slack = tolerance * length;
  if (length <= tolerance)
    return false; // corners on top of each other span no line
  double low = 0, high = 0, near = kInfinity, far = -kInfinity;
  for (int c = 0; c < 4; ++c) {
    for (const Box* box : {&a, &b}) {
      const double side = cross2(dx, dy, pick(*box, c, u, 1) - px, pick(*box, c, v, 2) - py);
      low = std::min(low, side);
      high = std::max(high, side);
    }
    const double side = cross2(dx, dy, pick(obstacle, c, u, 1) - px, pick(obstacle, c, v, 2) - py);
    near = std::min(near, side);
    far = std::max(far, side);
  }
  return (high <= slack && near >= -slack) || (low >= -slack && far <= slack);
}

/// The obstacle's box does not meet the convex hull of boxes a and b (sufficient, not necessary).
bool outside_shaft(const Box& a, const Box& b, const Box& obstacle, double tolerance) {
  for (int axis = 0; axis < 3; ++axis)
    if (obstacle.lo[axis] > std::max(a.hi[axis], b.hi[axis]) - tolerance ||
        obstacle.hi[axis] < std::min(a.lo[axis], b.lo[axis]) + tolerance)
      return true;
  for (int axis = 0; axis < 3; ++axis)
    for (int corner = 0; corner < 4; ++corner)
      if (tangent_separates(a, b, obstacle, (axis + 1) % 3, (axis + 2) % 3, corner, tolerance))
        return true;
  return false;
}
/// One obstacle per leaf, each in a plane of its own.
ClusterTree hierarchy_of(const std::vector<Obstacle>& obstacles) {
  std::vector<ClusterItem> items;
  for (std::size_t k = 0; k < obstacles.size(); ++k)
    items.push_back({obstacles[k].corner, obstacles[k].normal, static_cast<std::uint32_t>(k)});
  return ClusterTree(items, 1);
}

/// Points that hold a cluster: its outline, or the corners of its box.
std::span<const glm::dvec3> holding_points(const ClusterTree& tree, const Cluster& c,
                                           std::array<glm::dvec3, 8>& storage) {
  if (c.corners > 0)
    return tree.outline(c);
  for (int k = 0; k < 8; ++k)
    storage[static_cast<std::size_t>(k)] = {k & 1 ? c.box.hi.x : c.box.lo.x, k & 2 ? c.box.hi.y : c.box.lo.y,
                                            k & 4 ? c.box.hi.z : c.box.lo.z};
  return storage;
}

/// Highest height of a box over a plane: that of its middle plus the support half . |n|.
double high(const Box& box, const glm::dvec3& point, const glm::dvec3& normal) {
  const glm::dvec3 middle = 0.5 * (box.lo + box.hi), half = 0.5 * (box.hi - box.lo);
  return glm::dot(middle - point, normal) + glm::dot(half, glm::abs(normal));
}

/// Range of n . (q - p) for all normals n in the cone, p and q in two boxes of radii r: |w| cos(angle(w, axis) -+ half
/// angle of the cone) +- (r_p + r_q), w the way between the middles. Metres.
struct ConeHeights {
  double low = -kInfinity, high = kInfinity;
  ConeHeights(const NormalCone& cone, const Box& p, const Box& q) {
    const glm::dvec3 way = 0.5 * (q.lo + q.hi - p.lo - p.hi);
    const double length = glm::length(way), radii = 0.5 * (diameter(p) + diameter(q));
    if (cone.angle > std::numbers::pi || !(length > 0.0))
      return;
    const double angle = std::acos(std::clamp(glm::dot(way, cone.axis) / length, -1.0, 1.0));
    high = length * std::cos(std::max(angle - cone.angle, 0.0)) + radii;
    low = length * std::cos(std::min(angle + cone.angle, std::numbers::pi)) - radii;
  }
};

/// Distances from a plane, of the points of one cluster.
struct Heights {
  std::vector<double> of;
  Heights(std::span<const glm::dvec3> points, const glm::dvec3& point, const glm::dvec3& normal) {
    for (const glm::dvec3& p : points)
      of.push_back(glm::dot(p - point, normal));
  }
  double low() const { return *std::ranges::min_element(of); }
  double high() const { return *std::ranges::max_element(of); }
};
} // namespace

BlockVisibility::BlockVisibility(std::vector<Obstacle> obstacles)
    : obstacles_(std::move(obstacles)), hierarchy_(hierarchy_of(obstacles_)) {
  if (!obstacles_.empty())
    tolerance_m_ = kTouchTolerance * diameter(hierarchy_[0].box);
}

BlockVisibility::Range BlockVisibility::heights(const ClusterTree& tree, const Cluster& c, const glm::dvec3& point,
                                                const glm::dvec3& normal) {
  Range range{kInfinity, -kInfinity};
  const auto add = [&](const glm::dvec3& p) {
    const double h = glm::dot(p - point, normal);
    range = {std::min(range.low, h), std::max(range.high, h)};
  };
  for (const glm::dvec3& p : tree.outline(c))
    add(p);
  if (c.corners == 0)
    for (int k = 0; k < 8; ++k)
      add({k & 1 ? c.box.hi.x : c.box.lo.x, k & 2 ? c.box.hi.y : c.box.lo.y, k & 4 ? c.box.hi.z : c.box.lo.z});
  return range;
}

// Three tests, the cheap ones first: one plane, the cone of the normals, every plane by itself.
bool BlockVisibility::behind(const ClusterTree& tree, const Cluster& a, const Cluster& b) const {
  if (a.plane >= 0)
    return heights(tree, b, a.point, a.normal).high <= tolerance_m_;
  if (ConeHeights(a.cone, a.box, b.box).high <= tolerance_m_)
    return true;
  return a.size() <= kMostPlanes && std::ranges::all_of(tree.planes(a), [&](const ItemPlane& p) {
           return high(b.box, p.point, p.normal) <= tolerance_m_ ||
                  (b.corners > 0 && heights(tree, b, p.point, p.normal).high <= tolerance_m_);
         });
}

bool BlockVisibility::in_front(const ClusterTree& tree, const Cluster& a, const Cluster& b) const {
  if (a.plane >= 0)
    return heights(tree, b, a.point, a.normal).low >= -tolerance_m_;
  if (ConeHeights(a.cone, a.box, b.box).low >= -tolerance_m_)
    return true;
  return a.size() <= kMostPlanes && std::ranges::all_of(tree.planes(a), [&](const ItemPlane& p) {
           return high(b.box, p.point, -p.normal) <= tolerance_m_ ||
                  (b.corners > 0 && heights(tree, b, p.point, p.normal).low >= -tolerance_m_);
         });
}

bool BlockVisibility::shielded(const ClusterTree& tree, const Cluster& c, const Cluster& o) const {
  const auto below = [&](const glm::dvec3& point, const glm::dvec3& normal) {
    return high(o.box, point, normal) <= tolerance_m_ ||
           (o.childless() &&
            std::ranges::all_of(obstacles_[hierarchy_.order()[o.first]].corner,
                                [&](const glm::dvec3& q) { return glm::dot(q - point, normal) <= tolerance_m_; }));
  };
  if (c.plane >= 0)
    return below(c.point, c.normal);
  if (ConeHeights(c.cone, c.box, o.box).high <= tolerance_m_)
    return true;
  return c.size() <= kMostPlanes &&
         std::ranges::all_of(tree.planes(c), [&](const ItemPlane& p) { return below(p.point, p.normal); });
}

/// A segment from height ha to hb over the obstacle's plane crosses it at (ha b - hb a) / (ha - hb), a projective map
/// of either end: what holds for the segments between all corners holds for all segments.
Visibility BlockVisibility::past_obstacle(const ClusterTree& tree, const Cluster& a, const Cluster& b,
                                          const Obstacle& o) const {
  std::array<glm::dvec3, 8> box_a, box_b;
  const auto points_a = holding_points(tree, a, box_a), points_b = holding_points(tree, b, box_b);
  const Heights ha(points_a, o.corner[0], o.normal), hb(points_b, o.corner[0], o.normal);
  const double sign = ha.low() >= -tolerance_m_ && hb.high() <= tolerance_m_   ? 1.0
                      : ha.high() <= tolerance_m_ && hb.low() >= -tolerance_m_ ? -1.0
                                                                               : 0.0;
  // A cluster of several planes may face the other from the obstacle's plane itself.
  const auto beyond = [&](const Cluster& c, const Heights& h) {
    return c.plane >= 0 || h.low() > tolerance_m_ || h.high() < -tolerance_m_;
  };
  bool hidden = sign != 0.0 && beyond(a, ha) && beyond(b, hb);
  for (std::size_t k = 0; k < o.corner.size(); ++k) {
    const glm::dvec3 inward = glm::cross(o.normal, o.corner[(k + 1) % o.corner.size()] - o.corner[k]);
    const double length = glm::length(inward);
    if (!(length > 0.0))
      continue;
    const Heights sa(points_a, o.corner[k], inward / length), sb(points_b, o.corner[k], inward / length);
    if (sa.high() <= tolerance_m_ && sb.high() <= tolerance_m_)
      return Visibility::clear;
    if (sign == 0.0)
      continue;
    bool outside = true;
    for (std::size_t i = 0; i < sa.of.size(); ++i)
      for (std::size_t j = 0; j < sb.of.size(); ++j) {
        const double w = sign * (ha.of[i] * sb.of[j] - hb.of[j] * sa.of[i]);
        const double slack = tolerance_m_ * sign * (ha.of[i] - hb.of[j]);
        outside = outside && w <= slack;
        hidden = hidden && w >= -slack;
      }
    if (outside)
      return Visibility::clear;
  }
  return hidden ? Visibility::hidden : Visibility::mixed;
}

bool BlockVisibility::one_side(const Cluster& o, const Cluster& a, const Cluster& b) const {
  if (o.plane >= 0)
    return false; // has been looked at
  const ConeHeights ha(o.cone, o.box, a.box), hb(o.cone, o.box, b.box);
  return std::min(ha.low, hb.low) >= -tolerance_m_ || std::max(ha.high, hb.high) <= tolerance_m_;
}

template <class Visit>
bool BlockVisibility::search(const ClusterTree& tree, const Cluster& a, const Cluster& b, const Visit& visit) const {
  std::array<std::int32_t, 128> stack;
  std::size_t depth = 0;
  if (!hierarchy_.clusters().empty())
    stack[depth++] = 0;
  while (depth > 0) {
    const Cluster& o = hierarchy_[stack[--depth]];
    if (o.plane >= 0) {
      const Range ra = heights(tree, a, o.point, o.normal), rb = heights(tree, b, o.point, o.normal);
      if (std::min(ra.low, rb.low) >= -tolerance_m_ || std::max(ra.high, rb.high) <= tolerance_m_)
        continue; // both on one side: segments between them do not cross the plane
    }
    if (outside_shaft(a.box, b.box, o.box, tolerance_m_) || shielded(tree, a, o) || shielded(tree, b, o) ||
        one_side(o, a, b))
      continue;
    if (o.childless()) {
      const std::uint32_t item = hierarchy_.order()[o.first];
      const Visibility past = past_obstacle(tree, a, b, obstacles_[item]);
      if (past != Visibility::clear && !visit(item, past == Visibility::hidden))
        return true;
      continue;
    }
    if (depth + 2 > stack.size())
      return true;
    stack[depth++] = o.child[0];
    stack[depth++] = o.child[1];
  }
  return false;
}

Visibility BlockVisibility::between_clusters(const ClusterTree& tree, const Cluster& a, const Cluster& b) const {
  // All that may be in the way is looked at: one that hides the pair may come last.
  bool mixed = false, hidden = false;
  int looked_at = 0;
  const bool stopped = search(tree, a, b, [&](std::uint32_t, bool hides) {
    hidden = hides;
    mixed = true;
    return !hides && ++looked_at < kPatience;
  });
  return hidden ? Visibility::hidden : (mixed || stopped ? Visibility::mixed : Visibility::clear);
}

BlockVisibility::Between BlockVisibility::between(const ClusterTree& tree, const Cluster& a, const Cluster& b,
                                                  std::size_t limit) const {
  Between result;
  result.complete = !search(tree, a, b, [&](std::uint32_t item, bool) {
    result.items.push_back(item);
    return result.items.size() <= limit;
  });
  return result;
}

} // namespace daylit::radiosity
