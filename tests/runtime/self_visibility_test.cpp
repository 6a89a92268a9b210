// What is known of an object's shadows on itself without tracing a ray.

#include <gtest/gtest.h>

#include <cmath>

#include <glm/geometric.hpp>

#include "runtime/trace/self_visibility.h"
#include "runtime/trace/rigid_motion.h"
#include "test_scene.h"

namespace daylit {
namespace {

TEST(SelfVisibility, what_corners_agree_on_holds_between_them) {
  const ObjectMesh mesh = test::ring_with_wire();
  const auto scene = PacketScene::build(mesh.positions, mesh.triangles);
  ASSERT_TRUE(scene);
  constexpr float kAbove = 7e-5f;
  std::vector<glm::vec3> starts, lights;
  for (std::size_t v = 0; v < mesh.positions.size(); ++v)
    starts.push_back(mesh.positions[v] + kAbove * mesh.normals[v]);
  SelfVisibility known_of = SelfVisibility::find(*scene, starts, mesh.normals);
  ASSERT_FALSE(known_of.empty());
  for (int k = 0; k < 80; ++k) { // more than one word
    const float z = 1.0f - 2.0f * (static_cast<float>(k) + 0.5f) / 80.0f, turn = 2.4f * static_cast<float>(k);
    lights.push_back(glm::vec3(std::sqrt(1 - z * z) * glm::vec2(std::cos(turn), std::sin(turn)), z));
  }
  known_of.set_lights(lights);
  ASSERT_EQ(known_of.words(), 2u);
  int faced = 0, known = 0, wrong = 0, dark = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 7) {
    glm::vec3 x(0.0f), n(0.0f);
    for (const std::uint32_t v : mesh.triangles[t]) {
      x += starts[v] / 3.0f;
      n += mesh.normals[v] / 3.0f;
    }
    for (std::size_t j = 0; j < lights.size(); ++j) {
      if (glm::dot(n, lights[j]) <= 0.0f)
        continue;
      const KnownLights word = known_of.at(mesh.triangles[t], j / 64);
      const bool clear = word.clear >> j % 64 & 1u, blocked = word.blocked >> j % 64 & 1u;
      ASSERT_FALSE(clear && blocked);
      RayBlock rays{};
      rays.org_x[0] = x.x;
      rays.org_y[0] = x.y;
      rays.org_z[0] = x.z;
      rays.dir_x[0] = lights[j].x;
      rays.dir_y[0] = lights[j].y;
      rays.dir_z[0] = lights[j].z;
      rays.tfar[0] = 10.0f;
      const bool lost = scene->occluded(1u, rays) != 0;
      ++faced;
      known += clear || blocked;
      dark += blocked;
      wrong += lost ? clear : blocked;
    }
  }
  EXPECT_GT(known, faced / 2);
  EXPECT_GT(dark, faced / 50);
  EXPECT_LT(wrong, known / 200) << "facets of the wire's shadow";
}

TEST(RigidMotion, knows_a_turn_from_a_change_of_shape) {
  const ObjectMesh mesh = test::torus(0.15f, 0.07f, 24, 12);
  RigidMotion motion(mesh.positions);
  const ObjectSurface placed = test::place(mesh, {2.0, 3.4, 0.23}, 1.2);
  std::vector<glm::vec3> points;
  for (const glm::dvec3& p : placed.positions)
    points.emplace_back(2.0 * p); // a scale as well
  ASSERT_TRUE(motion.set(points));
  for (std::size_t v = 0; v < mesh.normals.size(); ++v)
    ASSERT_LT(glm::length(motion.rotation() * mesh.normals[v] - placed.normals[v]), 1e-4f);
  points[17].x += 1e-3f;
  EXPECT_FALSE(motion.set(points));
  EXPECT_FALSE(motion.set(std::span(points).first(20)));
}

/// The slow twin refits the hierarchy to vertices that were moved.
TEST(PacketScene, rays_transformed_to_a_mesh_meet_what_they_meet_of_a_moved_one) {
  const ObjectMesh mesh = test::torus(0.15f, 0.07f, 24, 12);
  auto placed = PacketScene::build(mesh.positions, mesh.triangles);
  auto moved = PacketScene::build(mesh.positions, mesh.triangles);
  ASSERT_TRUE(placed && moved);
  std::vector<glm::vec3> points;
  for (const glm::dvec3& p : test::place(mesh, {0.5, -0.4, 0.23}, 1.2).positions)
    points.emplace_back(1.5 * p);
  RigidMotion motion(mesh.positions);
  ASSERT_TRUE(motion.set(points));
  placed->set_transform(motion.to_first());
  ASSERT_TRUE(moved->move(points));
  int met = 0;
  for (int row = 0; row < 40; ++row) {
    RayBlock rays{};
    for (int k = 0; k < kLanes; ++k) {
      rays.org_x[k] = 0.35f + 0.05f * static_cast<float>(k);
      rays.org_y[k] = -1.05f + 0.025f * static_cast<float>(row);
      rays.org_z[k] = 1.0f;
      rays.dir_x[k] = 0.1f;
      rays.dir_z[k] = -2.0f; // not unit: distances are in its length
      rays.tfar[k] = 10.0f;
    }
    HitBlock a, b;
    placed->closest(0xFFFFu, rays, a);
    moved->closest(0xFFFFu, rays, b);
    EXPECT_EQ(placed->occluded(0xFFFFu, rays), moved->occluded(0xFFFFu, rays));
    EXPECT_EQ(placed->occluded(0x0104u, rays), moved->occluded(0x0104u, rays)) << "few rays go one by one";
    for (int k = 0; k < kLanes; ++k) {
      ASSERT_EQ(a.triangle[k] == kNoTriangle, b.triangle[k] == kNoTriangle);
      if (a.triangle[k] == kNoTriangle)
        continue;
      ++met;
      EXPECT_NEAR(a.distance[k], b.distance[k], 1e-5f);
    }
  }
  EXPECT_GT(met, 100);
}

} // namespace
} // namespace daylit
