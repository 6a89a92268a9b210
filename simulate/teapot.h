#pragma once

// Martin Newell's teapot (1975) from its bicubic Bezier patches, lid and bottom included.

#include <array>
#include <vector>

#include <glm/vec3.hpp>

#include "scene/model/object_mesh.h"

namespace daylit {

/// Rows of four control points, in the units and the frame of the published listing: z up, the spout along +x.
using BezierPatch = std::array<std::array<glm::dvec3, 4>, 4>;

/// The 32 patches: rim, body, lid and bottom (six turned profiles in four quarters each), handle and spout.
std::vector<BezierPatch> teapot_patches();
glm::dvec3 evaluate(const BezierPatch& patch, double u, double v);
/// Unit normal that points out of the teapot; at the poles, where a row of control points coincides, the limit.
glm::dvec3 outward_normal(const BezierPatch& patch, double u, double v);

/// `steps` x `steps` quads per patch, two triangles each (64 steps^2 triangles less the collapsed ones at the poles),
/// smooth normals, z up, standing on z = 0 with the body's axis at the origin, `width_m` from spout to handle.
ObjectMesh tessellate_teapot(int steps, double width_m, Rgb reflectance);

} // namespace daylit
