#include "scene/room/polygon.h"

#include <algorithm>
#include <cmath>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "scene/room/polygon_holes.h"

namespace daylit::detail {

namespace {

// Twice a triangle's area below this fraction of its longest side squared counts as zero.
constexpr double kFlat = 1e-12;

/// z of the cross product.
double cross2(const glm::dvec2& a, const glm::dvec2& b) { return a.x * b.y - a.y * b.x; }

double twice_area(const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& c) { return cross2(b - a, c - a); }

/// Outline with the corners not yet clipped as a ring of links, and each corner's ear quality.
class EarClipper {
public:
  explicit EarClipper(std::vector<glm::dvec2> points) : p_(std::move(points)) {
    const auto n = static_cast<std::uint32_t>(p_.size());
    previous_.resize(n);
    next_.resize(n);
    quality_.resize(n);
    for (std::uint32_t i = 0; i < n; ++i) {
      previous_[i] = (i + n - 1) % n;
      next_[i] = (i + 1) % n;
    }
    for (std::uint32_t i = 0; i < n; ++i)
      quality_[i] = ear_quality(i);
  }

  // The signed triangles add up to a chain whose border is the outline, so their winding numbers add up to those of
  // the outline: when every triangle is positive, an outline that does not cross itself is covered exactly once.
  std::optional<TriangleList> run() {
    TriangleList triangles;
    std::uint32_t start = 0;
    for (std::size_t left = p_.size(); left >= 3; --left) {
      const std::uint32_t ear = best_ear(start, left);
      if (quality_[ear] < 0.0)
        return std::nullopt;
      if (quality_[ear] > 0.0)
        triangles.push_back({previous_[ear], ear, next_[ear]});
      start = clip(ear);
    }
    if (triangles.empty())
      return std::nullopt;
    return triangles;
  }

private:
  std::uint32_t best_ear(std::uint32_t start, std::size_t left) const {
    std::uint32_t best = start;
    for (std::uint32_t i = start; left > 0; --left, i = next_[i])
      if (quality_[i] > quality_[best])
        best = i;
    return best;
  }

  std::uint32_t clip(std::uint32_t ear) {
    const std::uint32_t a = previous_[ear], c = next_[ear];
    next_[a] = c;
    previous_[c] = a;
    quality_[a] = ear_quality(a);
    quality_[c] = ear_quality(c);
    return c;
  }

  // > 0: an ear, larger is better shaped. 0: no area, may be dropped. -1: no ear.
  double ear_quality(std::uint32_t i) const {
    const glm::dvec2 a = p_[previous_[i]], b = p_[i], c = p_[next_[i]];
    const double longest = std::max({glm::dot(b - a, b - a), glm::dot(c - b, c - b), glm::dot(a - c, a - c)});
    const double area = twice_area(a, b, c);
    if (std::abs(area) <= kFlat * longest)
      return 0.0;
    if (area < 0.0)
      return -1.0;
    for (std::uint32_t j = next_[next_[i]]; j != previous_[i]; j = next_[j])
      if (blocks(p_[j], a, b, c, kFlat * longest))
        return -1.0;
    return area / longest;
  }

  static bool blocks(const glm::dvec2& q, const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& c, double flat) {
    if (q == a || q == b || q == c)
      return false;
    return twice_area(a, b, q) > flat && twice_area(b, c, q) > flat && twice_area(c, a, q) >= -flat;
  }

  std::vector<glm::dvec2> p_;
  std::vector<std::uint32_t> previous_, next_;
  std::vector<double> quality_;
};

} // namespace

/// Sum of the cross products of a fan: twice the vector area, of any polygon, planar or not (Newell).
glm::dvec3 newell_normal(std::span<const glm::dvec3> corners) {
  glm::dvec3 sum(0.0);
  for (std::size_t i = 1; i + 1 < corners.size(); ++i)
    sum += glm::cross(corners[i] - corners[0], corners[i + 1] - corners[0]);
  return sum;
}

double extent(std::span<const glm::dvec3> corners) {
  glm::dvec3 low = corners[0], high = corners[0];
  for (const glm::dvec3& p : corners) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  const glm::dvec3 size = high - low;
  return std::max({size.x, size.y, size.z});
}

/// Right-handed: u and v span the plane, n = u x v.
PlaneFrame PlaneFrame::make(const glm::dvec3& origin, const glm::dvec3& n) {
  const glm::dvec3 helper = std::abs(n.z) < 0.9 ? glm::dvec3(0, 0, 1) : glm::dvec3(1, 0, 0);
  const glm::dvec3 u = glm::normalize(glm::cross(helper, n));
  return {origin, u, glm::cross(n, u), n};
}

glm::dvec2 PlaneFrame::to_plane(const glm::dvec3& p) const {
  return {glm::dot(p - origin, u), glm::dot(p - origin, v)};
}

double PlaneFrame::height(const glm::dvec3& p) const { return glm::dot(p - origin, n); }

/// Ear clipping (Meisters 1975), best-shaped ear first, in the plane of the mean normal.
std::optional<TriangleList> triangulate(std::span<const glm::dvec3> corners) {
  if (corners.size() < 3)
    return std::nullopt;
  const glm::dvec3 normal = newell_normal(corners);
  const double length = glm::length(normal);
  if (!(length > 0.0))
    return std::nullopt;
  const PlaneFrame frame = PlaneFrame::make(corners[0], normal / length);
  std::vector<glm::dvec2> points;
  points.reserve(corners.size());
  for (const glm::dvec3& p : corners)
    points.push_back(frame.to_plane(p));
  const std::vector<std::uint32_t> order = order_against_holes(points);
  std::vector<glm::dvec2> ordered;
  for (const std::uint32_t k : order)
    ordered.push_back(points[k]);
  std::optional<TriangleList> triangles = EarClipper(std::move(ordered)).run();
  for (std::size_t t = 0; triangles && t < triangles->size(); ++t)
    for (std::uint32_t& k : (*triangles)[t])
      k = order[k];
  return triangles;
}

std::vector<glm::dvec3> without_straight_corners(std::span<const glm::dvec3> corners, double tolerance) {
  std::vector<glm::dvec3> kept(corners.begin(), corners.end());
  for (std::size_t i = 0; i < kept.size() && kept.size() > 3;) {
    const glm::dvec3 a = kept[(i + kept.size() - 1) % kept.size()], c = kept[(i + 1) % kept.size()];
    const double base = glm::distance(a, c);
    const double height = base > 0.0 ? glm::length(glm::cross(kept[i] - a, c - a)) / base : glm::distance(kept[i], a);
    if (height <= tolerance)
      kept.erase(kept.begin() + static_cast<std::ptrdiff_t>(i));
    else
      ++i;
  }
  return kept;
}

/// No turn to the right by more than 1e-9 (sine).
bool is_convex(std::span<const glm::dvec3> corners, const glm::dvec3& unit_normal) {
  const std::size_t n = corners.size();
  for (std::size_t i = 0; i < n; ++i) {
    const glm::dvec3 e = corners[(i + 1) % n] - corners[i], f = corners[(i + 2) % n] - corners[(i + 1) % n];
    if (glm::dot(glm::cross(e, f), unit_normal) < -1e-9 * glm::length(e) * glm::length(f))
      return false;
  }
  return true;
}

bool inside_convex(std::span<const glm::dvec3> corners, const glm::dvec3& unit_normal, const glm::dvec3& p,
                   double tolerance) {
  const std::size_t n = corners.size();
  for (std::size_t i = 0; i < n; ++i) {
    const glm::dvec3 e = corners[(i + 1) % n] - corners[i];
    if (glm::dot(glm::cross(e, p - corners[i]), unit_normal) < -tolerance * glm::length(e))
      return false;
  }
  return true;
}

} // namespace daylit::detail
