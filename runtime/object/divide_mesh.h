#pragma once

// Coarse meshes: light is kept at vertices, and a crate of twelve triangles has none where it touches the floor but its
// corners.

#include "scene/model/object_mesh.h"

namespace daylit {

/// Halves edges that are longer than a sixth of the radius (of the sphere around the mesh's box) until none is, or the
/// mesh has 60,000 triangles. The surface stays where it is; an edge is halved on both sides. The reflectance of
/// vertices on textures is looked up anew.
void divide_long_edges(ObjectMesh& mesh);

} // namespace daylit
