#include "scene/model/mesh_edges.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <glm/geometric.hpp>

namespace daylit {

namespace {

/// Points no two of which are within a tolerance.
class ApartPoints {
public:
  explicit ApartPoints(float tolerance) : tolerance_(tolerance) {}

  /// The number of a point within the tolerance; else this one becomes a new point.
  std::uint32_t near_or_new(const glm::vec3& p, std::uint32_t number) {
    const Cell c{cell(p.x), cell(p.y), cell(p.z)};
    for (int k = 0; k < 27; ++k) {
      const auto found = points_.find({c[0] + k % 3 - 1, c[1] + k / 3 % 3 - 1, c[2] + k / 9 - 1});
      if (found != points_.end() && glm::distance(found->second.first, p) <= tolerance_)
        return found->second.second;
    }
    points_.try_emplace(c, p, number);
    return number;
  }

private:
  using Cell = std::array<std::int64_t, 3>;
  std::int64_t cell(float x) const { return static_cast<std::int64_t>(std::floor(x / tolerance_)); }

  float tolerance_;
  std::map<Cell, std::pair<glm::vec3, std::uint32_t>> points_; ///< one in a cell
};

} // namespace

std::vector<std::uint32_t> position_numbers(const ObjectMesh& mesh) {
  std::map<std::array<float, 3>, std::uint32_t> known;
  std::vector<std::uint32_t> number;
  for (const glm::vec3& p : mesh.positions)
    number.push_back(known.try_emplace({p.x, p.y, p.z}, static_cast<std::uint32_t>(known.size())).first->second);
  return number;
}

std::vector<std::uint32_t> merged_numbers(const ObjectMesh& mesh, const std::vector<std::uint32_t>& number,
                                          float tolerance) {
  std::vector<bool> loose(mesh.positions.size(), false);
  for (const auto& [edge, balance] : edge_balance(mesh, number))
    if (balance != 0)
      loose[edge.first] = loose[edge.second] = true;
  ApartPoints points(tolerance);
  std::vector<std::uint32_t> merged = number;
  for (std::size_t v = 0; v < number.size(); ++v)
    if (loose[number[v]])
      merged[v] = points.near_or_new(mesh.positions[v] - mesh.positions[0], number[v]);
  return merged;
}

EdgeBalance edge_balance(const ObjectMesh& mesh, const std::vector<std::uint32_t>& number, const ObjectMaterial* of) {
  EdgeBalance balance;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (std::size_t k = 0; k < 3 && (!of || mesh.material_or_null(t) == of); ++k) {
      const std::uint32_t a = number[mesh.triangles[t][k]], b = number[mesh.triangles[t][(k + 1) % 3]];
      if (a != b)
        balance[std::minmax(a, b)] += a < b ? 1 : -1;
    }
  return balance;
}

bool is_balanced(const EdgeBalance& edges) {
  return std::ranges::all_of(edges, [](const auto& edge) { return edge.second == 0; });
}

} // namespace daylit
