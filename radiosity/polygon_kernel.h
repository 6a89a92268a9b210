#pragma once

// Closed-form and contour-integral form factors between unoccluded polygons.

#include <array>
#include <span>

#include <glm/vec3.hpp>

namespace daylit::radiosity {

/// Convex planar polygon of a few corners, counter-clockwise about its normal; what clipping makes of a triangle.
struct SmallPolygon {
  std::array<glm::dvec3, 12> corner;
  int size = 0;
};

/// The part of `polygon` in front of the plane through `point` with unit `normal` (front = along the normal).
SmallPolygon clip_to_front(const SmallPolygon& polygon, const glm::dvec3& point, const glm::dvec3& normal);

/// Form factor from a surface element (an infinitesimal area) at `point` facing `normal` to a polygon, either
/// orientation: clipped to the horizon of the element, then Lambert's F = (1/2pi) sum_i gamma_i (Gamma_i . n). Exact.
double point_to_polygon(const glm::dvec3& point, const glm::dvec3& normal, std::span<const glm::dvec3> polygon);

/// A_i F_ij in m^2 of two polygons that see each other's front entirely (clip first); symmetric by construction:
/// (1/2pi) sum over edge pairs of (u_p . u_q) times the double integral of ln r (Sparrow 1963). The inner integral
/// is closed; the outer one is closed for edges on one line and Gauss-Legendre with end-point clustering otherwise.
/// Relative error below 2e-5, and 1e-4 for plates that touch along an edge at 5 degrees (tests/radiosity).
double exchange_area_unoccluded(const SmallPolygon& a, const SmallPolygon& b);

/// Clips both to each other's front first; 0 when they cannot see each other. Corners in either order around each
/// outline, at most 10; the unit normals say which side emits.
double exchange_area_unoccluded(std::span<const glm::dvec3> a, const glm::dvec3& normal_a,
                                std::span<const glm::dvec3> b, const glm::dvec3& normal_b);

} // namespace daylit::radiosity
