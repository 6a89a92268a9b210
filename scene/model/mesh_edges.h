#pragma once

#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "scene/model/object_mesh.h"

namespace daylit {

/// By the numbers of an edge's two positions, the lower first: triangles that pass it upwards less those that pass it
/// downwards.
using EdgeBalance = std::map<std::pair<std::uint32_t, std::uint32_t>, int>;

/// Number of each vertex. Vertices at one position are one.
std::vector<std::uint32_t> position_numbers(const ObjectMesh& mesh);

/// The same where vertices on edges that are out of balance are also one within `tolerance` metres: the ends of a
/// surface of revolution meet to rounding only.
std::vector<std::uint32_t> merged_numbers(const ObjectMesh& mesh, const std::vector<std::uint32_t>& number,
                                          float tolerance);

/// Of all triangles, or of those with a material of the mesh.
EdgeBalance edge_balance(const ObjectMesh& mesh, const std::vector<std::uint32_t>& number,
                         const ObjectMaterial* of = nullptr);

/// Every edge has as many triangles on one side as on the other.
bool is_balanced(const EdgeBalance& edges);

} // namespace daylit
