#include "radiosity/detail/cluster_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace daylit::radiosity {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::size_t kOwnSubtree = 8; ///< planes of fewer items are not kept together
constexpr int kMiddleCuts = 40;        ///< deeper than this only halves are cut: the depth stays bounded

glm::dvec3 centroid(const ClusterItem& item) {
  glm::dvec3 sum(0.0);
  for (const glm::dvec3& c : item.corner)
    sum += c;
  return sum / static_cast<double>(item.corner.size());
}

/// Corners of the convex hull of points in a plane (Andrew's monotone chain in the two axes the plane spans best).
std::vector<glm::dvec3> planar_hull(std::vector<glm::dvec3> points, const glm::dvec3& normal) {
  const glm::dvec3 n = glm::abs(normal);
  const int drop = n.x >= n.y && n.x >= n.z ? 0 : (n.y >= n.z ? 1 : 2), u = (drop + 1) % 3, v = (drop + 2) % 3;
  std::ranges::sort(points,
                    [&](const glm::dvec3& a, const glm::dvec3& b) { return a[u] != b[u] ? a[u] < b[u] : a[v] < b[v]; });
  const auto turn = [&](const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
    return (b[u] - a[u]) * (c[v] - a[v]) - (b[v] - a[v]) * (c[u] - a[u]);
  };
  std::vector<glm::dvec3> hull;
  for (int pass = 0; pass < 2; ++pass) {
    const std::size_t base = hull.size();
    for (const glm::dvec3& p : points) {
      while (hull.size() >= base + 2 && turn(hull[hull.size() - 2], hull.back(), p) <= 0.0)
        hull.pop_back();
      hull.push_back(p);
    }
    hull.pop_back();
    std::ranges::reverse(points);
  }
  return hull;
}

/// Axis: mean normal; half angle: the largest to it. No cone where the normals cancel.
NormalCone cone_of(std::span<const ClusterItem> items, std::span<const std::uint32_t> which) {
  glm::dvec3 sum(0.0);
  for (const std::uint32_t i : which)
    sum += items[i].normal;
  const double length = glm::length(sum);
  if (!(length > 0.1 * static_cast<double>(which.size())))
    return {};
  NormalCone cone{sum / length, 0.0};
  double least = 1;
  for (const std::uint32_t i : which)
    least = std::min(least, glm::dot(cone.axis, items[i].normal));
  cone.angle = std::acos(std::clamp(least, -1.0, 1.0));
  return cone;
}

} // namespace

/// Between the nearest points of two boxes, metres.
double distance(const Box& a, const Box& b) {
  return glm::length(glm::max(glm::dvec3(0.0), glm::max(a.lo - b.hi, b.lo - a.hi)));
}

double diameter(const Box& box) { return glm::distance(box.lo, box.hi); }

/// Items are cut in six dimensions, position and normal times half the size of the room, so that clusters become flat
/// and face one way; large planes are kept together by the middle that all their items take as position.
ClusterTree::ClusterTree(std::span<const ClusterItem> items, std::uint32_t leaf_size)
    : leaf_size_(std::max(leaf_size, 1u)), order_(items.size()), key_(items.size()) {
  std::iota(order_.begin(), order_.end(), 0u);
  Box all{glm::dvec3(kInfinity), glm::dvec3(-kInfinity)};
  struct Sum {
    glm::dvec3 centre{0.0};
    std::size_t count = 0;
  };
  std::map<std::uint32_t, Sum> planes;
  for (const ClusterItem& item : items) {
    Sum& sum = planes[item.plane];
    sum.centre += centroid(item);
    ++sum.count;
    for (const glm::dvec3& c : item.corner)
      all = {glm::min(all.lo, c), glm::max(all.hi, c)};
  }
  normal_weight_m_ = items.empty() ? 0.0 : 0.5 * diameter(all);
  for (std::size_t i = 0; i < items.size(); ++i) {
    const Sum& sum = planes[items[i].plane];
    const glm::dvec3 at = sum.count >= kOwnSubtree ? sum.centre / static_cast<double>(sum.count) : centroid(items[i]);
    const glm::dvec3 n = normal_weight_m_ * items[i].normal;
    key_[i] = {at.x, at.y, at.z, n.x, n.y, n.z};
  }
  if (!items.empty())
    build(items, 0, static_cast<std::uint32_t>(items.size()), 0);
  key_ = decltype(key_)(); // frees it
  for (const std::uint32_t i : order_)
    planes_.push_back({items[i].corner[0], items[i].normal});
}

/// Box, normals, outline and plane of items [c.first, c.last), and the extent of their keys.
ClusterTree::KeyBox ClusterTree::measure(std::span<const ClusterItem> items, Cluster& c) {
  c.box = {glm::dvec3(kInfinity), glm::dvec3(-kInfinity)};
  KeyBox keys;
  keys.low.fill(kInfinity);
  keys.high.fill(-kInfinity);
  bool one_plane = true;
  for (std::uint32_t k = c.first; k < c.last; ++k) {
    const ClusterItem& item = items[order_[k]];
    one_plane = one_plane && item.plane == items[order_[c.first]].plane;
    for (const glm::dvec3& corner : item.corner)
      c.box = {glm::min(c.box.lo, corner), glm::max(c.box.hi, corner)};
    for (std::size_t a = 0; a < 6; ++a) {
      keys.low[a] = std::min(keys.low[a], key_[order_[k]][a]);
      keys.high[a] = std::max(keys.high[a], key_[order_[k]][a]);
    }
  }
  if (one_plane) {
    const ClusterItem& item = items[order_[c.first]];
    c.plane = static_cast<std::int32_t>(item.plane);
    c.point = item.corner[0];
    c.normal = item.normal;
  }
  c.cone = cone_of(items, std::span(order_).subspan(c.first, c.size()));
  outline_of(items, c);
  return keys;
}

/// Cuts at the middle of the longest side of the keys; a plane, and what is too deep, in halves along its longest side.
/// The first item of the second part.
std::uint32_t ClusterTree::divide(std::span<const ClusterItem> items, const Cluster& c, const KeyBox& keys, int depth) {
  const auto begin = order_.begin() + c.first, end = order_.begin() + c.last, half = begin + c.size() / 2;
  std::size_t axis = 0;
  for (std::size_t a = 1; a < 6; ++a)
    if (keys.high[a] - keys.low[a] > keys.high[axis] - keys.low[axis])
      axis = a;
  if (c.plane < 0 && depth < kMiddleCuts && keys.high[axis] > keys.low[axis]) {
    const double cut = 0.5 * (keys.low[axis] + keys.high[axis]);
    const auto middle = std::stable_partition(begin, end, [&](std::uint32_t i) { return key_[i][axis] < cut; });
    return static_cast<std::uint32_t>(middle - order_.begin());
  }
  const glm::dvec3 extent = c.box.hi - c.box.lo;
  const int along = extent.x >= extent.y && extent.x >= extent.z ? 0 : (extent.y >= extent.z ? 1 : 2);
  std::nth_element(begin, half, end, [&](std::uint32_t a, std::uint32_t b) {
    const double pa = centroid(items[a])[along], pb = centroid(items[b])[along];
    return pa != pb ? pa < pb : a < b;
  });
  return static_cast<std::uint32_t>(half - order_.begin());
}

std::int32_t ClusterTree::build(std::span<const ClusterItem> items, std::uint32_t first, std::uint32_t last,
                                int depth) {
  const auto index = static_cast<std::int32_t>(clusters_.size());
  clusters_.emplace_back();
  Cluster c;
  c.first = first;
  c.last = last;
  const KeyBox keys = measure(items, c);
  if (c.size() > leaf_size_) {
    const std::uint32_t split = divide(items, c, keys, depth);
    c.child[0] = build(items, first, split, depth + 1);
    c.child[1] = build(items, split, last, depth + 1);
  }
  clusters_[static_cast<std::size_t>(index)] = c;
  return index;
}

/// Convex hull of a flat cluster, all corners of a small mixed one.
void ClusterTree::outline_of(std::span<const ClusterItem> items, Cluster& c) {
  // The hull of a large mixed cluster would decide nothing that its box does not.
  if (c.plane < 0 && c.size() > leaf_size_)
    return;
  std::vector<glm::dvec3> points;
  for (std::uint32_t k = c.first; k < c.last; ++k)
    points.insert(points.end(), items[order_[k]].corner.begin(), items[order_[k]].corner.end());
  if (c.plane >= 0)
    points = planar_hull(std::move(points), c.normal);
  c.first_corner = static_cast<std::uint32_t>(corners_.size());
  c.corners = static_cast<std::uint32_t>(points.size());
  corners_.insert(corners_.end(), points.begin(), points.end());
}

} // namespace daylit::radiosity
