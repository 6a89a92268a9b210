// Rays in packets against meshes that move, and what of the lights a point sees by them.

#include <array>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include "runtime/trace/light_visibility.h"
#include "runtime/trace/packet_scene.h"
#include "runtime/trace/rigid_motion.h"
#include "test_scene.h"

namespace daylit {
namespace {

TEST(RigidMotion, knows_a_turn_from_a_change_of_shape) {
  const ObjectMesh mesh = test::torus(0.15f, 0.07f, 24, 12);
  RigidMotion motion(mesh.positions);
  std::vector<glm::vec3> points;
  for (const glm::dvec3& p : test::place(mesh, {2.0, 3.4, 0.23}, 1.2).positions)
    points.emplace_back(2.0 * p); // a scale as well
  ASSERT_TRUE(motion.set(points));
  const Similarity& back = motion.to_first();
  for (std::size_t v = 0; v < points.size(); ++v)
    ASSERT_LT(glm::length(back.origin + back.axes * points[v] - mesh.positions[v]), 1e-5f);
  points[17].x += 1e-3f;
  EXPECT_FALSE(motion.set(points));
  EXPECT_FALSE(motion.set(std::span(points).first(20)));
}

TEST(PacketScene, rays_meet_of_a_moved_or_transformed_mesh_what_they_meet_of_one_built_there) {
  const ObjectMesh mesh = test::torus(0.15f, 0.07f, 24, 12);
  std::vector<glm::vec3> points;
  for (const glm::dvec3& p : test::place(mesh, {0.5, -0.4, 0.23}, 1.2).positions)
    points.emplace_back(1.5 * p);
  auto moved = PacketScene::build(mesh.positions, mesh.triangles);
  const auto built = PacketScene::build(points, mesh.triangles);
  ASSERT_TRUE(moved && built);
  ASSERT_TRUE(moved->move(points));
  auto transformed = PacketScene::build(mesh.positions, mesh.triangles);
  RigidMotion motion(mesh.positions);
  ASSERT_TRUE(transformed && motion.set(points));
  transformed->set_transform(motion.to_first());
  EXPECT_FALSE(moved->move(std::span(points).first(20)));
  int met = 0;
  for (int row = 0; row < 40; ++row) {
    RayPacket16 rays{};
    for (int k = 0; k < kLanes; ++k) {
      rays.org_x[k] = 0.35f + 0.05f * static_cast<float>(k);
      rays.org_y[k] = -1.05f + 0.025f * static_cast<float>(row);
      rays.org_z[k] = 1.0f;
      rays.dir_x[k] = 0.1f;
      rays.dir_z[k] = -2.0f; // not unit: distances are in its length
      rays.tfar[k] = 10.0f;
    }
    RayHits16 a, b;
    built->closest(0xFFFFu, rays, a);
    const LaneMask all = built->occluded(0xFFFFu, rays);
    for (const PacketScene* other : {&*moved, &*transformed}) {
      other->closest(0xFFFFu, rays, b);
      EXPECT_EQ(other->occluded(0xFFFFu, rays), all);
      EXPECT_EQ(other->occluded(0x0104u, rays), all & 0x0104u) << "few rays go one by one";
      for (int k = 0; k < kLanes; ++k) {
        ASSERT_EQ(a.triangle[k] == kNoTriangle, b.triangle[k] == kNoTriangle);
        EXPECT_EQ(a.triangle[k] != kNoTriangle, (all >> k & 1u) != 0);
        if (a.triangle[k] == kNoTriangle)
          continue;
        ++met;
        EXPECT_NEAR(a.distance[k], b.distance[k], 1e-5f);
      }
    }
  }
  EXPECT_GT(met, 100);
}

/// A processor without vectors of sixteen takes another way through Embree: run these on one of each.
TEST(RayPackets, lanes_that_are_not_asked_for_may_hold_anything) {
  const std::vector<glm::dvec3> corners{{-1, -1, 1}, {1, -1, 1}, {0, 1, 1}};
  const std::vector<std::array<std::uint32_t, 3>> triangle{{0, 1, 2}};
  const auto room = RayScene::build(corners, triangle);
  const auto objects = PacketScene::build(std::vector<glm::vec3>(corners.begin(), corners.end()), triangle,
                                          PacketScene::Edges::quick, PacketScene::Hits::all_too);
  ASSERT_TRUE(room && objects);
  struct Count final : HitVisitor {
    std::array<int, kLanes> met{};
    void meet(int lane, std::uint32_t, float, float, float) override { ++met[static_cast<std::size_t>(lane)]; }
  };
  for (const int count : {1, 5, 8, 9, 15, 16}) {
    RayPacket16 rays;
    for (std::size_t k = 0; k < kLanes; ++k)
      if (k < static_cast<std::size_t>(count))
        rays.set(k, -glm::vec3(room->origin()), {0.0f, 0.0f, k % 2 ? -1.0f : 1.0f}, 0.0f, 10.0f);
      else
        rays.set(k, -glm::vec3(room->origin()), {0.0f, 0.0f, k % 2 ? NAN : 1.0f}, k % 4 < 2 ? -5.0f : 0.0f, 10.0f);
    const LaneMask asked = (1u << count) - 1u, met = asked & 0x5555u;
    std::array<std::uint32_t, 16> which{};
    RayHits16 hits;
    EXPECT_EQ(room->occluded16(rays, count), met) << count;
    EXPECT_EQ(room->closest16(rays, count, which), met) << count;
    EXPECT_EQ(room->closest16(rays, count, hits), met) << count;
    for (std::size_t k = 0; k < kLanes; ++k)
      rays.org_z[k] = 0.0f, rays.org_x[k] = 0.0f, rays.org_y[k] = 0.0f;
    EXPECT_EQ(objects->occluded(asked, rays), met) << count;
    objects->closest(asked, rays, hits);
    Count each;
    for (std::size_t k = 0; k < kLanes; ++k)
      if (k % 2 && asked >> k & 1u)
        rays.dir_z[k] = 1.0f, rays.dir_x[k] = 9.0f; // beside it
    objects->all(asked, rays, each);
    for (std::size_t k = 0; k < kLanes; ++k) {
      EXPECT_EQ(hits.triangle[k] != kNoTriangle, (met >> k & 1u) != 0) << count;
      EXPECT_EQ(each.met[k], static_cast<int>(met >> k & 1u)) << count;
    }
  }
}

TEST(SeePoint, a_sheet_shades_the_floor_at_its_very_foot) {
  const std::vector<glm::vec3> corners{{0, -1, 0}, {0, 1, 0}, {0, 1, 1}, {0, -1, 1}};
  const std::vector<std::array<std::uint32_t, 3>> halves{{0, 1, 2}, {0, 2, 3}};
  const PacketScene sheet = *PacketScene::build(corners, halves);
  const ShadowCasters casters{&sheet, nullptr, nullptr, {0, 0, 0.5f}, 1.5f, {0, -1, 0}, {0, 1, 1}};
  TracedLights lights;
  const DirectionalLight sun{glm::normalize(glm::dvec3(-1, 0.1, 1)), Rgb(1.0f)};
  lights.portal = PortalLights(std::span(&sun, 1), {}, glm::dvec3(0.0));
  for (const float away : {1e-2f, 1e-3f, 1e-4f, 1e-5f, 1e-6f})
    for (const float side : {1.0f, -1.0f}) {
      PixelSurface floor{true, true, {side * away, 0, 0}, {0, 0, 1}, {side * away, 0, 0}, false};
      KnownLights objects, room;
      see_point(lights, casters, Layer::room, floor, {&objects, 1}, {&room, 1});
      EXPECT_EQ(objects.blocked, side > 0.0f ? 1u : 0u) << side * away << " m";
    }
}

} // namespace
} // namespace daylit
