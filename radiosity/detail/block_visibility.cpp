#include "radiosity/detail/block_visibility.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace daylit::radiosity {

namespace {
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kTouchTolerance = 1e-7; // of the room's size: rounding of coplanar corners

double cross2(double ax, double ay, double bx, double by) { return ax * by - ay * bx; }

/// Sides of the hull of two boxes, seen along one axis: does a tangent line to both keep the obstacle on its far
/// side? (Shaft culling, Haines & Wallace 1991.) u, v: the two remaining axes; `corner` picks lo or hi of each.
template <class Box>
bool tangent_separates(const Box& a, const Box& b, const Box& obstacle, int u, int v, int corner, double tolerance) {
  const auto pick = [&](const Box& box, int c, int axis, int bit) { return c & bit ? box.hi[axis] : box.lo[axis]; };
  const double px = pick(a, corner, u, 1), py = pick(a, corner, v, 2);
  const double dx = pick(b, corner, u, 1) - px, dy = pick(b, corner, v, 2) - py;
  const double length = std::hypot(dx, dy), slack = tolerance * length;
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
template <class Box>
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
} // namespace

BlockVisibility::BlockVisibility(const ElementSet& set, const PatchMesh& mesh, std::size_t block_size) {
  planes_.resize(mesh.planes, {glm::dvec3(0.0), glm::dvec3(0.0), {glm::dvec3(kInfinity), glm::dvec3(-kInfinity)}});
  double extent = 0;
  for (const Patch& p : mesh.patches) {
    Plane& plane = planes_[p.plane];
    plane.point = p.corner[0];
    plane.normal = p.normal;
    for (const glm::dvec3& c : p.corner) {
      plane.bounds.lo = glm::min(plane.bounds.lo, c);
      plane.bounds.hi = glm::max(plane.bounds.hi, c);
      extent = std::max({extent, std::abs(c.x), std::abs(c.y), std::abs(c.z)});
    }
  }
  tolerance_m_ = kTouchTolerance * extent;
  const std::size_t blocks = (set.elements.size() + block_size - 1) / block_size;
  blocks_.resize(blocks, {glm::dvec3(kInfinity), glm::dvec3(-kInfinity)});
  range_.resize(blocks * planes_.size(), {kInfinity, -kInfinity});
  for (std::size_t i = 0; i < set.elements.size(); ++i)
    for (const glm::dvec3& c : set.elements[i].corner) {
      Box& box = blocks_[i / block_size];
      box.lo = glm::min(box.lo, c);
      box.hi = glm::max(box.hi, c);
      for (std::size_t k = 0; k < planes_.size(); ++k) {
        const double h = glm::dot(c - planes_[k].point, planes_[k].normal);
        Range& r = range_[i / block_size * planes_.size() + k];
        r = {std::min(r.low, h), std::max(r.high, h)};
      }
    }
}

bool BlockVisibility::clear(std::size_t a, std::size_t b) const {
  for (std::size_t k = 0; k < planes_.size(); ++k) {
    const Range &ra = range_[a * planes_.size() + k], &rb = range_[b * planes_.size() + k];
    if (std::min(ra.low, rb.low) >= -tolerance_m_ || std::max(ra.high, rb.high) <= tolerance_m_)
      continue; // both blocks on one side: segments between them do not cross the plane
    if (!outside_shaft(blocks_[a], blocks_[b], planes_[k].bounds, tolerance_m_))
      return false;
  }
  return true;
}

} // namespace daylit::radiosity
