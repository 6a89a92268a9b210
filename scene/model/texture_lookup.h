#pragma once

#include <cmath>

#include <glm/geometric.hpp>
#include <glm/mat2x2.hpp>
#include <glm/matrix.hpp>

#include "scene/model/object_mesh.h"

namespace daylit::detail {

/// The textures of a mesh at one place of a triangle, averaged over a part of its surface.
class TextureLookup {
public:
  /// `u`, `v`: weights of corners 1 and 2. `width_m`: side of the part, metres of the mesh.
  TextureLookup(const ObjectMesh& mesh, std::size_t triangle, float u, float v, float width_m) : mesh_(mesh) {
    if (mesh.uv.empty())
      return;
    const auto& t = mesh.triangles[triangle];
    const glm::vec2 a = mesh.uv[t[0]], along = mesh.uv[t[1]] - a, across = mesh.uv[t[2]] - a;
    uv_ = a + u * along + v * across;
    const glm::vec3 p = mesh.positions[t[0]];
    const float area = glm::length(glm::cross(mesh.positions[t[1]] - p, mesh.positions[t[2]] - p));
    const float area_uv = std::fabs(along.x * across.y - along.y * across.x);
    width_uv_ = area > 0.0f ? width_m * std::sqrt(area_uv / area) : 0.0f;
  }

  /// Linear values; 1 where there is no texture.
  Rgb at(const TextureUse& use) const {
    if (!use || mesh_.uv.empty())
      return Rgb(1.0f);
    const glm::vec3 p = use.uv_from_mesh * glm::vec3(uv_, 1.0f);
    const float stretch = std::sqrt(std::fabs(glm::determinant(glm::mat2(use.uv_from_mesh))));
    return mesh_.textures[static_cast<std::size_t>(use.texture)].at(glm::vec2(p), stretch * width_uv_);
  }

private:
  const ObjectMesh& mesh_;
  glm::vec2 uv_{0.0f};
  float width_uv_ = 0.0f;
};

} // namespace daylit::detail
