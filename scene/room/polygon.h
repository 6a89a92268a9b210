#pragma once

// Planar polygons in space: normal, frame, triangulation, convexity. Corners are in order around the outline.

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

namespace daylit::detail {

/// Newell's normal: length = twice the enclosed area, direction by the right-hand rule. Exact for planar polygons,
/// a least-squares-like mean for warped ones. Relative to the first corner, so far from the origin nothing is lost.
glm::dvec3 newell_normal(std::span<const glm::dvec3> corners);

/// Longest side of the axis-aligned box of the corners.
double extent(std::span<const glm::dvec3> corners);

/// Orthonormal frame of a plane: u x v = n.
struct PlaneFrame {
  glm::dvec3 origin{0.0}, u{0.0}, v{0.0}, n{0.0};
  static PlaneFrame make(const glm::dvec3& origin, const glm::dvec3& unit_normal);
  glm::dvec2 to_plane(const glm::dvec3& p) const;
  double height(const glm::dvec3& p) const;
};

/// Ear clipping in the polygon's own plane; concave outlines and outlines that touch themselves along a bridge to a
/// hole are fine. Triangles keep the orientation of the outline, none has zero area; corners on a straight edge may
/// be left out of all triangles. Empty: the outline crosses itself or encloses nothing.
using TriangleList = std::vector<std::array<std::uint32_t, 3>>;
std::optional<TriangleList> triangulate(std::span<const glm::dvec3> corners);

/// The outline without corners closer than `tolerance` (m) to the line through their neighbours.
std::vector<glm::dvec3> without_straight_corners(std::span<const glm::dvec3> corners, double tolerance);

/// No corner turns clockwise seen against `unit_normal`.
bool is_convex(std::span<const glm::dvec3> corners, const glm::dvec3& unit_normal);

/// True when p, assumed in the plane, is inside or within `tolerance` (m) of a convex outline.
bool inside_convex(std::span<const glm::dvec3> corners, const glm::dvec3& unit_normal, const glm::dvec3& p,
                   double tolerance);

/// The point of triangle a b c that is nearest to p, by the Voronoi region of corner, edge or face that p lies in
/// (Ericson 2005, section 5.1.5).
template <class Vector>
Vector nearest_on_triangle(const Vector& p, const Vector& a, const Vector& b, const Vector& c) {
  const Vector ab = b - a, ac = c - a;
  const auto d1 = glm::dot(ab, p - a), d2 = glm::dot(ac, p - a);
  if (d1 <= 0 && d2 <= 0)
    return a;
  const auto d3 = glm::dot(ab, p - b), d4 = glm::dot(ac, p - b);
  if (d3 >= 0 && d4 <= d3)
    return b;
  const auto d5 = glm::dot(ab, p - c), d6 = glm::dot(ac, p - c);
  if (d6 >= 0 && d5 <= d6)
    return c;
  const auto wa = d3 * d6 - d5 * d4, wb = d5 * d2 - d1 * d6, wc = d1 * d4 - d3 * d2;
  if (wc <= 0 && d1 >= 0 && d3 <= 0)
    return a + d1 / (d1 - d3) * ab;
  if (wb <= 0 && d2 >= 0 && d6 <= 0)
    return a + d2 / (d2 - d6) * ac;
  if (wa <= 0 && d4 >= d3 && d5 >= d6)
    return b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b);
  return a + wb / (wa + wb + wc) * ab + wc / (wa + wb + wc) * ac;
}

} // namespace daylit::detail
