#pragma once

// Convex sets of directions bounded by planes through one point: what a window, a triangle or a part of one looks like
// from there.

#include <span>
#include <vector>

#include <glm/vec3.hpp>

namespace daylit::detail {

/// Unit directions to the corners, at least three, counter-clockwise as seen from the point; smaller than a hemisphere.
using Cone = std::vector<glm::dvec3>;

/// The cone of a convex polygon with these corners seen from `eye`; empty where it is seen edge-on or the eye is at a
/// corner.
Cone cone_of(const std::vector<glm::dvec3>& corners, const glm::dvec3& eye);
/// Around an axis, with `sides` equal sides and the solid angle of the disc; angular radius < pi/4.
Cone cone_of_disc(const glm::dvec3& axis, double angular_radius, int sides);

/// The part with dot(d, plane) >= 0; empty when nothing is left.
Cone clipped(const Cone& cone, const glm::dvec3& plane);
/// The part inside `other`.
Cone intersection(const Cone& cone, const Cone& other);
/// Adds the parts of `cone` outside `other` to `parts`; returns the part inside.
Cone subtract(const Cone& cone, const Cone& other, std::vector<Cone>& parts);
/// True unless an edge of either separates them by more than rounding.
bool may_overlap(const Cone& a, const Cone& b);
/// Is every corner of `inner` inside `outer`?
bool contains(const Cone& outer, const Cone& inner);

/// Steradians (Van Oosterom & Strackee 1983).
double solid_angle_sr(std::span<const glm::dvec3> cone);
/// Integral of the direction over the cone: its dot product with a normal is the form factor times pi, exactly
/// (Lambert 1760), when the whole cone is in front of the surface.
glm::dvec3 vector_area(std::span<const glm::dvec3> cone);
glm::dvec3 centroid(std::span<const glm::dvec3> cone);

} // namespace daylit::detail
