#include "runtime/object/simplify_mesh.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "runtime/object/mesh_topology.h"
#include "runtime/object/senders.h"
#include "test_scene.h"

namespace daylit {
namespace {

constexpr float kRing = 0.2f, kTube = 0.1f; // radii of the torus

/// Of a point from the torus around z; signed.
float height(const glm::vec3& p) { return std::hypot(std::hypot(p.x, p.y) - kRing, p.z) - kTube; }

glm::vec3 normal(const glm::vec3& p) {
  const glm::vec3 ring = kRing * glm::normalize(glm::vec3(p.x, p.y, 0.0f));
  return glm::normalize(p - ring);
}

ObjectMesh dense_torus() { return test::torus(kRing, kTube, 400, 400); }

TEST(SimplifyMesh, a_dense_torus_has_few_triangles_and_is_still_that_torus) {
  ObjectMesh mesh = dense_torus();
  ASSERT_GT(mesh.positions.size(), kMostSenders);
  ASSERT_TRUE(simplify_dense(mesh));
  EXPECT_LT(mesh.triangles.size(), 30'000u);
  EXPECT_GT(mesh.triangles.size(), 1000u);
  const float side = 2.0f * (kRing + kTube);
  double area = 0.0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const glm::vec3 p = (mesh.positions[a] + mesh.positions[b] + mesh.positions[c]) / 3.0f;
    ASSERT_LT(std::abs(height(p)), 2e-3f * side); // a few deviations: they are mean squares of an edge's surroundings
    const glm::vec3 m = glm::normalize(mesh.normals[a] + mesh.normals[b] + mesh.normals[c]);
    ASSERT_GT(glm::dot(m, normal(p)), std::cos(0.15f));
    area += 0.5 * static_cast<double>(glm::length(
                      glm::cross(mesh.positions[b] - mesh.positions[a], mesh.positions[c] - mesh.positions[a])));
  }
  const double pi = 3.14159265358979;
  EXPECT_NEAR(area, 4.0 * pi * pi * 0.2 * 0.1, 0.01 * area);
}

TEST(SimplifyMesh, a_closed_mesh_stays_closed) {
  ObjectMesh mesh = dense_torus();
  constexpr std::size_t kSide = 400;
  for (std::size_t k = 0; k <= kSide; ++k) { // the seams' vertices have the same bits on both sides
    mesh.positions[k * (kSide + 1) + kSide] = mesh.positions[k * (kSide + 1)];
    mesh.positions[kSide * (kSide + 1) + k] = mesh.positions[k];
  }
  mesh.positions.back() = mesh.positions.front();
  ASSERT_TRUE(is_closed(mesh));
  ASSERT_TRUE(simplify_dense(mesh));
  EXPECT_TRUE(is_closed(mesh));
}

TEST(SimplifyMesh, bumps_that_are_lower_than_the_deviation_stay_for_their_normals) {
  ObjectMesh mesh = dense_torus();
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) { // 1e-4 m high, slopes of up to 1 in 4
    const glm::vec3 p = mesh.positions[v], n = mesh.normals[v];
    const float step = 1e-4f, wave = 2500.0f;
    mesh.positions[v] += step * std::sin(wave * p.z) * n;
    mesh.normals[v] = glm::normalize(n - step * wave * std::cos(wave * p.z) * (glm::vec3(0, 0, 1) - n.z * n));
  }
  const std::size_t before = mesh.triangles.size();
  ASSERT_TRUE(simplify_dense(mesh));
  EXPECT_GT(mesh.triangles.size(), before / 3);
}

TEST(SimplifyMesh, materials_keep_their_triangles_and_colours_their_vertices) {
  ObjectMesh mesh = dense_torus();
  mesh.materials.resize(2);
  for (const auto& t : mesh.triangles)
    mesh.triangle_material.push_back(mesh.positions[t[0]].x + mesh.positions[t[1]].x + mesh.positions[t[2]].x > 0.0f);
  for (std::size_t v = 0; v < mesh.positions.size(); ++v)
    mesh.reflectance[v] = Rgb(mesh.positions[v].x + 0.5f);
  mesh.colours = mesh.reflectance;
  ASSERT_TRUE(simplify_dense(mesh));
  ASSERT_LT(mesh.triangles.size(), 60'000u);
  ASSERT_EQ(mesh.triangle_material.size(), mesh.triangles.size());
  ASSERT_EQ(mesh.colours.size(), mesh.positions.size());
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    EXPECT_EQ(mesh.colours[v], Rgb(mesh.positions[v].x + 0.5f));
    EXPECT_EQ(mesh.reflectance[v], mesh.colours[v]);
    EXPECT_LT(std::abs(height(mesh.positions[v])), 1e-5f) << "a vertex is one of the old ones";
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    float x = 0.0f;
    for (const std::uint32_t v : mesh.triangles[t])
      x += mesh.positions[v].x / 3.0f;
    if (std::abs(x) > 0.01f) {
      EXPECT_EQ(mesh.triangle_material[t], x > 0.0f ? 1 : 0);
    }
  }
}

TEST(SimplifyMesh, a_mesh_that_is_not_dense_keeps_every_bit) {
  ObjectMesh mesh = test::torus(kRing, kTube, 100, 60);
  const ObjectMesh before = mesh;
  ASSERT_TRUE(simplify_dense(mesh));
  EXPECT_EQ(mesh.positions, before.positions);
  EXPECT_EQ(mesh.triangles, before.triangles);
  ObjectMesh none;
  EXPECT_TRUE(simplify_dense(none));
}

} // namespace
} // namespace daylit
