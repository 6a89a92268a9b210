#include <algorithm>

#include <glm/geometric.hpp>

#include "scene/model/mesh_edit.h"
#include "scene/model/surface_look.h"

namespace daylit {

namespace {

/// Directions on a triangle in which u and v grow, as long as its area, and their sides turned to u to the right and v
/// down: p = p0 + u' e1 + v' e2 and uv = uv0 + u' f1 + v' f2 solved for dp/du and dp/dv.
struct Growth {
  glm::vec3 u{0.0f}, v{0.0f};
};
Growth growth(const ObjectMesh& mesh, std::size_t triangle, const glm::mat3& uv_from_mesh) {
  const auto& t = mesh.triangles[triangle];
  const auto uv = [&](std::size_t k) { return glm::vec2(uv_from_mesh * glm::vec3(mesh.uv[t[k]], 1.0f)); };
  const glm::vec3 e1 = mesh.positions[t[1]] - mesh.positions[t[0]], e2 = mesh.positions[t[2]] - mesh.positions[t[0]];
  const glm::vec2 f1 = uv(1) - uv(0), f2 = uv(2) - uv(0);
  const float side = f1.x * f2.y - f1.y * f2.x < 0.0f ? -1.0f : 1.0f, area = glm::length(glm::cross(e1, e2));
  const glm::vec3 u = side * (f2.y * e1 - f1.y * e2), v = side * (f1.x * e2 - f2.x * e1);
  const float u_length = glm::length(u), v_length = glm::length(v);
  return {u_length > 0.0f ? area / u_length * u : glm::vec3(0.0f),
          v_length > 0.0f ? area / v_length * v : glm::vec3(0.0f)};
}

/// The bitangent n x t points against the growth of v: glTF's maps have their second axis up, pictures begin at the
/// top.
glm::vec4 tangent(const glm::vec3& normal, const Growth& sum) {
  const glm::vec3 t = sum.u - glm::dot(sum.u, normal) * normal;
  const float length = glm::length(t);
  if (!(length > 1e-6f * glm::length(sum.u)) || !(length > 0.0f))
    return {around_axis(normal), 1.0f};
  return {t / length, glm::dot(glm::cross(normal, t), sum.v) > 0.0f ? -1.0f : 1.0f};
}

} // namespace

void set_tangents(ObjectMesh& mesh) {
  if (!mesh.tangents.empty() || std::ranges::none_of(mesh.materials, &ObjectMaterial::needs_tangents))
    return;
  std::vector<Growth> sum(mesh.positions.size());
  for (std::size_t k = 0; k < mesh.triangles.size() && !mesh.uv.empty(); ++k) {
    const Growth g = growth(mesh, k, mesh.material_or_null(k)->normal_texture.uv_from_mesh);
    for (const std::uint32_t v : mesh.triangles[k]) {
      sum[v].u += g.u;
      sum[v].v += g.v;
    }
  }
  for (std::size_t v = 0; v < sum.size(); ++v)
    mesh.tangents.push_back(tangent(mesh.normals[v], sum[v]));
}

} // namespace daylit
