#pragma once

// Coarse meshes: light is kept at vertices. A crate of twelve triangles has none where it touches the floor but its
// corners, and where a slat of a chair meets a post the light changes within a centimetre or two.

#include "scene/model/object_mesh.h"

namespace daylit {

/// A mesh with edges that are longer than a sixth of the radius (of the sphere around its box): halves these, and then
/// edges that are longer than three times the distance of the mesh's other surfaces, or of the floor below its lowest
/// vertex, where that changes threefold along the edge: in three rounds, or until the mesh has 60,000 triangles. Edges
/// of a 24th of the radius are left. The surface stays where it is; an edge is halved on both sides. The reflectance of
/// vertices on textures is looked up anew.
void divide_coarse_mesh(ObjectMesh& mesh);

} // namespace daylit
