#pragma once

#include <cstdint>
#include <vector>

#include "scene/model/object_mesh.h"

namespace daylit {

/// Vertices that share a position, as they do along seams of normals or textures, have one number. Numbers run from 0.
std::vector<std::uint32_t> position_groups(const ObjectMesh& mesh);

/// Every edge, between positions, has exactly one twin of the opposite direction: nobody sees a back.
bool is_closed(const ObjectMesh& mesh);

} // namespace daylit
