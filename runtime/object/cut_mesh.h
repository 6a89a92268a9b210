#pragma once

// Meshes whose parts run through one another, like a handle that ends inside a pot: light is kept at vertices, and a
// triangle with one corner in the light and one inside the pot would carry the light in, or the darkness out.

#include <cstddef>

#include "scene/core/result.h"
#include "scene/model/object_mesh.h"

namespace daylit {

/// Cuts every edge that another part of the mesh crosses once, and the triangles beside it, where it is crossed. The
/// surface stays where it is but for a slit of two thousandths of the edge; the sides have no common vertex. Crossings
/// within a fiftieth of the edge's ends are left, and edges that are crossed more than once. Returns the number of
/// edges cut. Error: no ray scene.
Result<std::size_t> cut_where_parts_cross(ObjectMesh& mesh);

} // namespace daylit
