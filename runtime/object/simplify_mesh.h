#pragma once

// Dense meshes: triangles much smaller than a pixel cost memory, rays and light in every frame, and show nothing.

#include "scene/core/result.h"
#include "scene/model/object_mesh.h"

namespace daylit {

/// A mesh of more than kMostSenders vertices (senders.h) gets fewer triangles, between some of its vertices. The
/// surface leaves the old one by no more than about a fourteen-hundredth of the longest side, and nine normals of ten
/// turn by less than three degrees, or the mesh stays as it is: one whose detail is real stays dense. Borders stay
/// where they are, those between materials too. Error: no ray scene.
Result<void> simplify_dense(ObjectMesh& mesh);

} // namespace daylit
