#include "scene/model/glass_check.h"

#include <algorithm>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "scene/model/mesh_edges.h"

namespace daylit {

namespace {

constexpr float kMeet = 1e-5f; // of the object's size: vertices that are one

bool is_solid_glass(const ObjectMaterial& m) { return m.transmission > 0.0f && !m.thin; }

float size_of(const ObjectMesh& mesh) {
  glm::vec3 low(mesh.positions[0]), high(low);
  for (const glm::vec3& p : mesh.positions) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  return glm::length(high - low);
}

/// Six times the volume that the faces of a material enclose, where they are closed; negative: inside out.
double signed_volume(const ObjectMesh& mesh, const ObjectMaterial& material) {
  const auto corner = [&](std::uint32_t v) { return glm::dvec3(mesh.positions[v]) - glm::dvec3(mesh.positions[0]); };
  double sum = 0.0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (const auto& [a, b, c] = mesh.triangles[t]; mesh.material_or_null(t) == &material)
      sum += glm::dot(corner(a), glm::cross(corner(b), corner(c)));
  return sum;
}

/// An edge of the material has a face on one side only, of this material or another.
bool has_hole(const EdgeBalance& own, const EdgeBalance& all) {
  return std::ranges::any_of(own, [&](const auto& edge) { return edge.second != 0 && all.at(edge.first) != 0; });
}

} // namespace

std::vector<std::string> glass_notes(const ObjectMesh& mesh, const std::string& name) {
  std::vector<std::string> lines;
  if (mesh.triangles.empty() || std::ranges::none_of(mesh.materials, is_solid_glass))
    return lines;
  const auto number = merged_numbers(mesh, position_numbers(mesh), std::max(kMeet * size_of(mesh), 1e-9f));
  for (const ObjectMaterial& m : mesh.materials) {
    if (!is_solid_glass(m))
      continue;
    const EdgeBalance own = edge_balance(mesh, number, &m);
    const std::string where = name + (m.name.empty() ? "" : fmt::format(", material \"{}\"", m.name)) + ": the glass";
    if (is_balanced(own)) {
      if (signed_volume(mesh, m) < 0.0)
        lines.push_back(where +
                        " is inside out, its normals point inwards: light is bent as by a bubble of air in glass; "
                        "recalculate the normals outside");
    } else if (has_hole(own, edge_balance(mesh, number))) {
      lines.push_back(where + " is open: what is seen through the hole is bent and coloured once too often or too "
                              "little; close the mesh, or give it no thickness (a thin pane)");
    }
  }
  return lines;
}

} // namespace daylit
