#pragma once

// Meshes whose parts see each other.

#include <cmath>
#include <numbers>

#include "scene/model/object_mesh.h"
#include "test_scene.h"

namespace daylit::test {

/// A sphere of 1 m without its top: a part `open` of its area is missing.
inline ObjectMesh bowl(float open) {
  ObjectMesh mesh;
  constexpr int kAround = 48, kAcross = 40;
  for (int i = 0; i <= kAcross; ++i)
    for (int j = 0; j <= kAround; ++j) {
      const float z = -1.0f + 2.0f * (1.0f - open) * static_cast<float>(i) / kAcross, r = std::sqrt(1.0f - z * z);
      const float a = 2.0f * std::numbers::pi_v<float> * static_cast<float>(j) / kAround;
      mesh.positions.emplace_back(r * std::cos(a), r * std::sin(a), z);
      mesh.normals.push_back(mesh.positions.back());
      mesh.reflectance.emplace_back(0.5f);
    }
  const auto at = [](int i, int j) { return static_cast<std::uint32_t>(i * (kAround + 1) + j); };
  for (int i = 0; i < kAcross; ++i)
    for (int j = 0; j < kAround; ++j) {
      mesh.triangles.push_back({at(i, j), at(i, j + 1), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i + 1, j)});
    }
  return mesh;
}

/// A pot, a ball of 0.2 m, and a pipe of 0.03 m that leads out of it along x.
inline ObjectMesh pot_with_pipe() {
  ObjectMesh mesh = torus(0.0f, 0.2f, 48, 24);
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  constexpr std::uint32_t kAround = 8;
  for (const float x : {0.12f, 0.17f, 0.24f, 0.3f})
    for (std::uint32_t k = 0; k < kAround; ++k) {
      const float a = 2.0f * std::numbers::pi_v<float> * (static_cast<float>(k) + 0.3f) / kAround;
      mesh.normals.push_back({0.0f, std::cos(a), std::sin(a)});
      mesh.positions.push_back(glm::vec3(x, 0, 0) + 0.03f * mesh.normals.back());
      mesh.reflectance.push_back(Rgb(0.7f));
    }
  for (std::uint32_t ring = 0; ring < 3; ++ring)
    for (std::uint32_t k = 0; k < kAround; ++k) {
      const std::uint32_t a = first + ring * kAround + k, b = first + ring * kAround + (k + 1) % kAround;
      mesh.triangles.push_back({a, b + kAround, a + kAround});
      mesh.triangles.push_back({a, b, b + kAround});
    }
  return mesh;
}

} // namespace daylit::test
