#pragma once

// The sphere of directions on a square, areas kept: the equal-area octahedral map (Clarberg 2008, "Fast equal-area
// mapping of the (hemi)sphere using SIMD"; in the survey of Cigolle et al. 2014 among the most even ones). The centre
// of the square looks along +z, its four corners along -z; the middles of its right and upper sides are the horizon's
// +x and +y. Every texel of a side x side map has the solid angle 4 pi / side^2.

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

namespace daylit {

/// Unit direction of a point of the square [-1, 1]^2. The points of a row of texels along a diamond |u| + |v| = const
/// share their z to the last bit.
glm::dvec3 octahedral_direction(const glm::dvec2& square);

/// Its inverse, within 1e-15; any length above 0 of `direction`.
glm::dvec2 octahedral_point(const glm::dvec3& direction);

} // namespace daylit
