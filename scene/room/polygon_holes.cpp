#include "scene/room/polygon_holes.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include <glm/geometric.hpp>

#include "scene/room/polygon.h"

namespace daylit::detail {

namespace {

using Loop = std::vector<glm::dvec3>;

double turn(const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// Do the segments have a point in common that is no end of both?
bool cross(const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& c, const glm::dvec2& d) {
  if (a == c || a == d || b == c || b == d)
    return false;
  const auto within = [](const glm::dvec2& p, const glm::dvec2& q, const glm::dvec2& r) {
    return std::min(p.x, q.x) <= r.x && r.x <= std::max(p.x, q.x) && std::min(p.y, q.y) <= r.y &&
           r.y <= std::max(p.y, q.y);
  };
  const double ta = turn(c, d, a), tb = turn(c, d, b), tc = turn(a, b, c), td = turn(a, b, d);
  if (((ta > 0) != (tb > 0)) && ((tc > 0) != (td > 0)) && ta != 0 && tb != 0 && tc != 0 && td != 0)
    return true;
  return (ta == 0 && within(c, d, a)) || (tb == 0 && within(c, d, b)) || (tc == 0 && within(a, b, c)) ||
         (td == 0 && within(a, b, d));
}

class Bridges {
public:
  explicit Bridges(const PlaneFrame& frame) : frame_(frame) {}

  bool is_free(const glm::dvec3& from, const glm::dvec3& to, const Loop& loop) const {
    const glm::dvec2 a = frame_.to_plane(from), b = frame_.to_plane(to);
    for (std::size_t k = 0; k < loop.size(); ++k)
      if (cross(a, b, frame_.to_plane(loop[k]), frame_.to_plane(loop[(k + 1) % loop.size()])))
        return false;
    return true;
  }

  bool loops_cross(const Loop& one, const Loop& other) const {
    for (std::size_t k = 0; k < one.size(); ++k)
      if (!is_free(one[k], one[(k + 1) % one.size()], other))
        return true;
    return false;
  }

  /// The shortest free bridge from the hole's corner `from` to the outline; holes: those not yet joined.
  std::optional<std::size_t> find(const Loop& outline, const std::vector<Loop>& holes, const glm::dvec3& from) const {
    std::vector<std::size_t> order(outline.size());
    for (std::size_t k = 0; k < order.size(); ++k)
      order[k] = k;
    std::ranges::stable_sort(order, {}, [&](std::size_t k) { return glm::distance(outline[k], from); });
    for (const std::size_t k : order)
      if (is_free(from, outline[k], outline) &&
          std::ranges::all_of(holes, [&](const Loop& hole) { return is_free(from, outline[k], hole); }))
        return k;
    return std::nullopt;
  }

  double height(const glm::dvec3& p) const { return frame_.to_plane(p).x; }

private:
  const PlaneFrame& frame_;
};

using Flat = std::vector<glm::dvec2>;

double signed_area(std::span<const glm::dvec2> loop) {
  double sum = 0;
  for (std::size_t k = 1; k + 1 < loop.size(); ++k)
    sum += 0.5 * turn(loop[0], loop[k], loop[k + 1]);
  return sum;
}

/// By the parity of the edges to the right of it.
bool is_inside(const glm::dvec2& p, std::span<const glm::dvec2> loop) {
  bool inside = false;
  for (std::size_t k = 0; k < loop.size(); ++k) {
    const glm::dvec2 &a = loop[k], &b = loop[(k + 1) % loop.size()];
    if ((a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x))
      inside = !inside;
  }
  return inside;
}

/// Turns the loop [first, last] of the corners round, which begins and ends with the same one, if it is a hole in the
/// others and runs as they do.
void turn_hole(std::vector<std::uint32_t>& order, std::size_t first, std::size_t last,
               std::span<const glm::dvec2> corners) {
  Flat hole, rest;
  for (std::size_t k = 0; k < order.size(); ++k)
    (k >= first && k <= last ? hole : rest).push_back(corners[order[k]]);
  if (signed_area(hole) * signed_area(rest) > 0.0 && is_inside(hole[0], rest))
    std::reverse(order.begin() + static_cast<std::ptrdiff_t>(first),
                 order.begin() + static_cast<std::ptrdiff_t>(last) + 1);
}

} // namespace

std::vector<std::uint32_t> order_against_holes(std::span<const glm::dvec2> corners) {
  const std::size_t n = corners.size();
  std::vector<std::uint32_t> order(n);
  std::iota(order.begin(), order.end(), 0u);
  // Calls visit(first, last) for each loop between a seam.
  const auto each_loop = [&](const auto& visit) {
    const auto at = [&](std::size_t k) { return corners[order[k % n]]; };
    for (std::size_t i = 0; i + 4 < n; ++i)
      for (std::size_t j = i + 3; j < n; ++j)
        if (at(j) == at(i + 1) && at(j + 1) == at(i))
          visit(i + 1, j);
  };
  bool any = false;
  each_loop([&](std::size_t, std::size_t) { any = true; });
  if (!any)
    return order;
  // From the corner furthest along an axis, which is none of a hole's.
  const auto outermost = std::ranges::max_element(corners, {}, [](const glm::dvec2& p) { return std::pair(p.x, p.y); });
  std::ranges::rotate(order, order.begin() + (outermost - corners.begin()));
  each_loop([&](std::size_t first, std::size_t last) { turn_hole(order, first, last, corners); });
  return order;
}

std::optional<std::vector<glm::dvec3>> bridged_outline(const Loop& outline, std::vector<Loop> holes) {
  const glm::dvec3 normal = newell_normal(outline);
  if (!(glm::length(normal) > 0.0))
    return std::nullopt;
  const auto frame = PlaneFrame::make(outline[0], glm::normalize(normal));
  const Bridges bridges(frame);
  for (std::size_t i = 0; i < holes.size(); ++i) {
    if (bridges.loops_cross(holes[i], outline))
      return std::nullopt;
    for (std::size_t k = 0; k < i; ++k)
      if (bridges.loops_cross(holes[i], holes[k]))
        return std::nullopt;
    if (glm::dot(newell_normal(holes[i]), normal) > 0.0)
      std::reverse(holes[i].begin(), holes[i].end());
    // From the corner furthest along the plane's first axis, which no bridge of a later hole can hide.
    const auto furthest = std::max_element(holes[i].begin(), holes[i].end(), [&](const auto& a, const auto& b) {
      return bridges.height(a) < bridges.height(b);
    });
    std::rotate(holes[i].begin(), furthest, holes[i].end());
  }
  std::sort(holes.begin(), holes.end(),
            [&](const Loop& a, const Loop& b) { return bridges.height(a[0]) > bridges.height(b[0]); });
  Loop joined = outline;
  while (!holes.empty()) {
    const auto at = bridges.find(joined, holes, holes.front()[0]);
    if (!at)
      return std::nullopt;
    Loop way = holes.front();
    way.push_back(holes.front()[0]);
    way.push_back(joined[*at]);
    joined.insert(joined.begin() + static_cast<std::ptrdiff_t>(*at) + 1, way.begin(), way.end());
    holes.erase(holes.begin());
  }
  return joined;
}

} // namespace daylit::detail
