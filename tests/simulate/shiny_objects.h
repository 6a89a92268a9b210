#pragma once

// Objects that mirror and refract, and their materials.

#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "scene/model/object_mesh.h"

namespace daylit::test {

inline ObjectMesh with_material(ObjectMesh mesh, const ObjectMaterial& material) {
  mesh.materials = {material};
  mesh.reflectance.assign(mesh.positions.size(), material.base_colour);
  return mesh;
}

inline ObjectMesh sphere(const glm::vec3& centre, float radius, const ObjectMaterial& material) {
  constexpr std::uint32_t kRings = 48, kSectors = 96;
  ObjectMesh mesh;
  for (std::uint32_t i = 0; i <= kRings; ++i)
    for (std::uint32_t j = 0; j <= kSectors; ++j) {
      const float polar = std::numbers::pi_v<float> * static_cast<float>(i) / kRings,
                  turn = 2.0f * std::numbers::pi_v<float> * static_cast<float>(j) / kSectors;
      const glm::vec3 n(std::sin(polar) * std::cos(turn), std::sin(polar) * std::sin(turn), std::cos(polar));
      mesh.positions.push_back(centre + radius * n);
      mesh.normals.push_back(n);
    }
  for (std::uint32_t i = 0; i < kRings; ++i)
    for (std::uint32_t j = 0; j < kSectors; ++j) {
      const std::uint32_t a = i * (kSectors + 1) + j, b = a + kSectors + 1;
      if (i > 0)
        mesh.triangles.push_back({a, b, a + 1});
      if (i + 1 < kRings)
        mesh.triangles.push_back({a + 1, b, b + 1});
    }
  return with_material(std::move(mesh), material);
}

/// Box from `low` to `high`, flat.
inline ObjectMesh box(const glm::vec3& low, const glm::vec3& high, const ObjectMaterial& material) {
  ObjectMesh mesh;
  for (int axis = 0; axis < 3; ++axis)
    for (const float side : {-1.0f, 1.0f}) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      const auto first = static_cast<std::uint32_t>(mesh.positions.size());
      for (const glm::vec2 c : {glm::vec2(0, 0), glm::vec2(1, 0), glm::vec2(1, 1), glm::vec2(0, 1)}) {
        glm::vec3 p, n(0.0f);
        p[axis] = side > 0.0f ? high[axis] : low[axis];
        p[u] = c.x > 0.5f ? high[u] : low[u];
        p[v] = c.y > 0.5f ? high[v] : low[v];
        n[axis] = side;
        mesh.positions.push_back(p);
        mesh.normals.push_back(n);
      }
      if (side > 0.0f)
        mesh.triangles.insert(mesh.triangles.end(), {{first, first + 1, first + 2}, {first, first + 2, first + 3}});
      else
        mesh.triangles.insert(mesh.triangles.end(), {{first, first + 2, first + 1}, {first, first + 3, first + 2}});
    }
  return with_material(std::move(mesh), material);
}

inline ObjectMaterial metal(float roughness, Rgb colour = Rgb(1.0f)) {
  ObjectMaterial m;
  m.base_colour = colour;
  m.metallic = 1.0f;
  m.roughness = roughness;
  return m;
}

inline ObjectMaterial varnish(float roughness) {
  ObjectMaterial m;
  m.base_colour = Rgb(1.0f);
  m.roughness = roughness;
  return m;
}

inline ObjectMaterial glass(float roughness, float ior = 1.5f) {
  ObjectMaterial m = varnish(roughness);
  m.transmission = 1.0f;
  m.ior = ior;
  return m;
}

} // namespace daylit::test
