#pragma once

// Changes of a finished mesh that keep its arrays together: nothing else may add vertices to one.

#include <cstdint>

#include <glm/mat4x4.hpp>

#include "scene/core/result.h"
#include "scene/model/object_mesh.h"

namespace daylit {

/// Adds a vertex on the edge from a to b, t from 0 to 1, all that a vertex has linear along it; its number. At t = 1/2
/// the same bits for both directions of the edge, but for a normal where those of the ends cancel: that of `a`.
std::uint32_t add_between(ObjectMesh& mesh, std::uint32_t a, std::uint32_t b, float t);

/// Vertices that no triangle uses are gone; the others keep their order.
void drop_unused_vertices(ObjectMesh& mesh);

/// Reflectance of the vertices: what the material sends back of light from everywhere, textures averaged over the
/// triangles around. Diffuse: the base colour. Else what the interfaces reflect of diffuse light (Kulla & Conty 2017)
/// comes before it; glass sends 2 F / (1 + F), as a pane does.
void set_reflectance(ObjectMesh& mesh);
/// Of the vertices: the part of it that is diffuse. Meshes without materials are.
std::vector<Rgb> diffuse_reflectance(const ObjectMesh& mesh);
/// Of the vertices: mean_mirrored_reflectance() of the materials, which the mesh has.
std::vector<Rgb> mirrored_reflectance(const ObjectMesh& mesh);

/// Tangents of the vertices, where a material needs them and the mesh has none: the direction in which u of the normal
/// map (or of the mesh) grows, mean of the triangles around (Lengyel 2001); without uv around the z axis.
void set_tangents(ObjectMesh& mesh);

/// The whole mesh is of one material from here on; its own materials, textures and vertex colours are gone.
void give_material(ObjectMesh& mesh, ObjectMaterial material);

/// Adds a mesh, placed. `all_from_part`: rigid but for one scale. Error limit_exceeded: more than 65,535 materials.
Result<void> append_mesh(ObjectMesh& all, ObjectMesh part, const glm::dmat4& all_from_part);

/// Winding and normals of a file may disagree; the normals win. From here on the winding says what is outside.
void wind_by_normals(ObjectMesh& mesh);

} // namespace daylit
