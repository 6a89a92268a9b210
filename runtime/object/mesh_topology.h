#pragma once

#include <cstdint>
#include <vector>

#include "scene/model/object_mesh.h"

namespace daylit {

/// Vertices at one position, as they are along seams of normals or textures, have one number. Numbers run from 0.
std::vector<std::uint32_t> position_groups(const ObjectMesh& mesh);

/// Every edge, between positions, has exactly one twin of the opposite direction, and every connected part is wound
/// outwards: nobody sees a back.
bool is_closed(const ObjectMesh& mesh);

} // namespace daylit
