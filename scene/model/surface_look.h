#pragma once

// What a mesh looks like at one point of its surface: the one place where textures, vertex colours and normal maps are
// applied, for the renderer and for the path tracer.

#include <cstddef>

#include <glm/vec3.hpp>

#include "scene/material/material.h"
#include "scene/model/object_mesh.h"

namespace daylit {

struct SurfaceLook {
  SurfaceMaterial material;
  glm::vec3 normal{0.0f, 0.0f, 1.0f};  ///< unit, frame of the mesh, smooth, with the normal map; points outwards
  glm::vec3 tangent{1.0f, 0.0f, 0.0f}; ///< unit, across the normal: the direction that alpha_u belongs to
  glm::vec3 smooth{0.0f, 0.0f, 1.0f};  ///< the normal without the map
};

/// At weights u and v of corners 1 and 2 of a triangle. `footprint_m`: side of the part of the surface that is seen, in
/// metres of the mesh; textures are averaged over it. Without tangents in the mesh the direction runs around its z
/// axis.
SurfaceLook surface_look(const ObjectMesh& mesh, std::size_t triangle, float u, float v, float footprint_m);

/// The base colour alone, the rest of the look left out: of a diffuse surface, its reflectance.
Rgb base_colour(const ObjectMesh& mesh, std::size_t triangle, float u, float v, float footprint_m);

/// Unit direction around the z axis, across a unit normal; x where the normal is along it.
glm::vec3 around_axis(const glm::vec3& normal);

} // namespace daylit
