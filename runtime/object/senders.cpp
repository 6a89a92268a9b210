#include "runtime/object/senders.h"

#include <algorithm>
#include <numeric>
#include <unordered_map>

#include <glm/common.hpp>

namespace daylit {

namespace {

constexpr float kCells = 40.0f; // along the longest side

} // namespace

MeshSenders find_senders(const ObjectMesh& mesh, std::size_t most) {
  MeshSenders senders;
  senders.of.resize(mesh.positions.size());
  if (senders.of.size() <= most) {
    std::iota(senders.of.begin(), senders.of.end(), 0u);
    senders.vertex = senders.of;
    return senders;
  }
  glm::vec3 low = mesh.positions[0], high = low;
  for (const glm::vec3& p : mesh.positions) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  const glm::vec3 size = high - low;
  const float per_m = kCells / std::max({size.x, size.y, size.z, 1e-9f});
  std::unordered_map<std::uint32_t, std::uint32_t> first;
  for (std::uint32_t v = 0; v < senders.of.size(); ++v) {
    const glm::vec3 cell = glm::floor(per_m * (mesh.positions[v] - low)), &n = mesh.normals[v];
    const std::uint32_t octant = (n.x < 0.0f ? 1u : 0u) + (n.y < 0.0f ? 2u : 0u) + (n.z < 0.0f ? 4u : 0u);
    std::uint32_t key = octant;
    for (int axis = 0; axis < 3; ++axis)
      key = key << 8 | static_cast<std::uint32_t>(cell[axis]);
    const auto [known, made] = first.emplace(key, static_cast<std::uint32_t>(senders.vertex.size()));
    if (made)
      senders.vertex.push_back(v);
    senders.of[v] = known->second;
  }
  return senders;
}

} // namespace daylit
