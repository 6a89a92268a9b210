#include "runtime/object/mesh_topology.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

namespace daylit {

std::vector<std::uint32_t> position_groups(const ObjectMesh& mesh) {
  std::vector<std::uint32_t> order(mesh.positions.size()), group(order.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto key = [&](std::uint32_t v) {
    const glm::vec3& p = mesh.positions[v];
    return std::array{p.x, p.y, p.z};
  };
  std::ranges::sort(order, {}, key);
  std::uint32_t number = 0;
  for (std::size_t k = 0; k < order.size(); ++k) {
    number += k > 0 && key(order[k]) != key(order[k - 1]);
    group[order[k]] = number;
  }
  return group;
}

/// Triangles that collapse to an edge or a point, as at a pole, have none.
bool is_closed(const ObjectMesh& mesh) {
  const std::vector<std::uint32_t> group = position_groups(mesh);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges, twins;
  for (const auto& t : mesh.triangles) {
    const std::uint32_t g[3] = {group[t[0]], group[t[1]], group[t[2]]};
    if (g[0] == g[1] || g[1] == g[2] || g[2] == g[0])
      continue;
    for (int k = 0; k < 3; ++k) {
      edges.emplace_back(g[k], g[(k + 1) % 3]);
      twins.emplace_back(g[(k + 1) % 3], g[k]);
    }
  }
  std::ranges::sort(edges);
  std::ranges::sort(twins);
  return edges == twins;
}

} // namespace daylit
