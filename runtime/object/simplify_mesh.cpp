#include "runtime/object/simplify_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <meshoptimizer.h>

#include "runtime/object/senders.h"
#include "scene/model/mesh_edit.h"
#include "scene/room/ray_scene.h"

namespace daylit {

namespace {

constexpr float kDeviation = 7e-4f;      // of the longest side: a third of a pixel where that covers 500
constexpr int kTries = 4;                // each with half the deviation of the one before
constexpr float kTurned = 0.052f;        // of a normal: three degrees
constexpr float kLeastKept = 0.9f;       // of the normals, that are turned by less
constexpr float kReach = 4.0f;           // in which a vertex looks for the simpler surface, in deviations
constexpr float kOnePlace = 1e-6f;       // of the longest side: vertices nearer to each other are at one place
constexpr float kOneNormal = 5e-3f;      // the same of their normals
constexpr std::size_t kLookedAt = 20000; // vertices

using Triangles = std::vector<std::array<std::uint32_t, 3>>;

float longest_side(const ObjectMesh& mesh) {
  glm::vec3 low = mesh.positions[0], high = low;
  for (const glm::vec3& p : mesh.positions) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  const glm::vec3 size = high - low;
  return std::max({size.x, size.y, size.z, 1e-9f});
}

/// What the vertices at one place are told apart by.
struct VertexKey {
  glm::vec3 place{0.0f}, normal{0.0f};
  Rgb reflectance{0.0f}, colour{0.0f};
  glm::vec2 uv{0.0f};
  glm::vec4 tangent{0.0f};
};

/// A dense mesh as meshoptimizer takes it.
struct DenseMesh {
  std::vector<glm::vec3> places;                          ///< of the vertices, in units of kOnePlace: whole numbers
  std::map<std::uint16_t, std::vector<unsigned>> corners; ///< of each material's triangles, three each
};

/// Per vertex: the first one that is like it.
std::vector<unsigned> first_alike(const ObjectMesh& mesh, std::span<const glm::vec3> places) {
  std::vector<VertexKey> keys(places.size());
  for (std::size_t v = 0; v < keys.size(); ++v) {
    keys[v] = {places[v], glm::round(mesh.normals[v] / kOneNormal), mesh.reflectance[v]};
    if (!mesh.colours.empty())
      keys[v].colour = mesh.colours[v];
    if (!mesh.uv.empty())
      keys[v].uv = mesh.uv[v];
    if (!mesh.tangents.empty())
      keys[v].tangent = mesh.tangents[v];
  }
  std::vector<unsigned> group(keys.size());
  const std::size_t count =
      meshopt_generateVertexRemap(group.data(), nullptr, keys.size(), keys.data(), keys.size(), sizeof(VertexKey));
  std::vector<unsigned> first(count);
  for (std::size_t v = keys.size(); v-- > 0;)
    first[group[v]] = static_cast<unsigned>(v);
  for (unsigned& g : group)
    g = first[g];
  return group;
}

DenseMesh dense_mesh(const ObjectMesh& mesh, float side) {
  DenseMesh dense;
  for (const glm::vec3& p : mesh.positions)
    dense.places.push_back(glm::round(p / (kOnePlace * side)) + 0.0f); // no negative zeros
  const std::vector<unsigned> alike = first_alike(mesh, dense.places);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    std::vector<unsigned>& corners =
        dense.corners[mesh.triangle_material.empty() ? std::uint16_t{0} : mesh.triangle_material[t]];
    for (const std::uint32_t v : mesh.triangles[t])
      corners.push_back(alike[v]);
  }
  return dense;
}

/// Edge collapses by quadric error (Garland & Heckbert 1997).
Triangles collapsed(const DenseMesh& dense, float deviation, std::vector<std::uint16_t>& material) {
  Triangles triangles;
  material.clear();
  for (const auto& [of, corners] : dense.corners) {
    std::vector<unsigned> left(corners.size());
    left.resize(meshopt_simplify(left.data(), corners.data(), corners.size(), &dense.places[0].x, dense.places.size(),
                                 sizeof(glm::vec3), 0, deviation, meshopt_SimplifyLockBorder, nullptr));
    for (std::size_t k = 0; k + 2 < left.size(); k += 3)
      triangles.push_back({left[k], left[k + 1], left[k + 2]});
    material.resize(triangles.size(), of);
  }
  return triangles;
}

/// Of the vertex normals n, the part for which |n - m| < kTurned, m being that of the triangles within `reach`.
Result<float> kept_normals(const ObjectMesh& mesh, const Triangles& triangles, float reach) {
  const auto rays = RayScene::build(std::vector<glm::dvec3>(mesh.positions.begin(), mesh.positions.end()), triangles);
  if (!rays)
    return rays.error();
  std::size_t kept = 0, count = 0;
  for (std::size_t v = 0; v < mesh.positions.size(); v += mesh.positions.size() / kLookedAt + 1, ++count) {
    const glm::vec3 &n = mesh.normals[v], from = rays->to_local(glm::dvec3(mesh.positions[v])) + reach * n;
    RayHit hit;
    if (!rays->closest(from, -n, 0.0f, 2.0f * reach, hit))
      continue;
    const auto& [a, b, c] = triangles[hit.triangle];
    const glm::vec3 m = (1.0f - hit.u - hit.v) * mesh.normals[a] + hit.u * mesh.normals[b] + hit.v * mesh.normals[c];
    kept += glm::distance(n, glm::normalize(m)) < kTurned;
  }
  return static_cast<float>(kept) / static_cast<float>(count);
}

} // namespace

Result<void> simplify_dense(ObjectMesh& mesh) {
  if (mesh.positions.size() <= kMostSenders || mesh.triangles.empty())
    return {};
  const float side = longest_side(mesh);
  const DenseMesh dense = dense_mesh(mesh, side);
  float deviation = kDeviation;
  for (int k = 0; k < kTries; ++k, deviation /= 2.0f) {
    std::vector<std::uint16_t> material;
    Triangles triangles = collapsed(dense, deviation, material);
    const auto kept = kept_normals(mesh, triangles, kReach * deviation * side);
    if (!kept)
      return kept.error();
    if (*kept < kLeastKept)
      continue;
    mesh.triangles = std::move(triangles);
    mesh.triangle_material = dense.corners.size() > 1 ? std::move(material) : std::vector<std::uint16_t>{};
    drop_unused_vertices(mesh);
    return {};
  }
  return {};
}

} // namespace daylit
