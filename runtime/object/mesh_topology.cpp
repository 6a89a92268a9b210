#include "runtime/object/mesh_topology.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include <glm/geometric.hpp>

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

namespace {

/// Number of the connected part of each position, by its edges.
std::vector<std::uint32_t> parts_of(const std::vector<std::array<std::uint32_t, 3>>& triangles, std::size_t positions) {
  std::vector<std::uint32_t> part(positions);
  std::iota(part.begin(), part.end(), 0u);
  const auto find = [&](std::uint32_t p) {
    while (part[p] != p)
      p = part[p] = part[part[p]];
    return p;
  };
  for (const auto& t : triangles)
    for (std::size_t k = 1; k < 3; ++k)
      part[find(t[k])] = find(t[0]);
  for (std::uint32_t p = 0; p < positions; ++p)
    part[p] = find(p);
  return part;
}

} // namespace

/// Triangles that collapse to an edge or a point, as at a pole, have none. The volume of a part is the sum of
/// a.(b x c) / 6 over its triangles, from one point: above zero where it is wound outwards.
bool is_closed(const ObjectMesh& mesh) {
  const std::vector<std::uint32_t> group = position_groups(mesh);
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges, twins;
  for (const auto& t : mesh.triangles) {
    const std::array<std::uint32_t, 3> g{group[t[0]], group[t[1]], group[t[2]]};
    triangles.push_back(g);
    if (g[0] == g[1] || g[1] == g[2] || g[2] == g[0])
      continue;
    for (std::size_t k = 0; k < 3; ++k) {
      edges.emplace_back(g[k], g[(k + 1) % 3]);
      twins.emplace_back(g[(k + 1) % 3], g[k]);
    }
  }
  std::ranges::sort(edges);
  std::ranges::sort(twins);
  if (edges != twins)
    return false;
  const std::vector<std::uint32_t> part = parts_of(triangles, mesh.positions.size());
  std::vector<double> volume(mesh.positions.size(), 0.0);
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const auto corner = [&](std::size_t k) {
      return glm::dvec3(mesh.positions[mesh.triangles[t][k]]) - glm::dvec3(mesh.positions[0]);
    };
    volume[part[triangles[t][0]]] += glm::dot(corner(0), glm::cross(corner(1), corner(2)));
  }
  return std::ranges::none_of(volume, [](double v) { return v < 0.0; });
}

} // namespace daylit
