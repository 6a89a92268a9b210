#include <algorithm>
#include <cmath>
#include <map>

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <gtest/gtest.h>

#include "radiosity/patches.h"

namespace daylit::radiosity {
namespace {

void add_quad(Room& room, glm::dvec3 a, glm::dvec3 b, glm::dvec3 c, glm::dvec3 d, std::uint32_t material = 0) {
  const auto first = static_cast<std::uint32_t>(room.vertices.size());
  room.vertices.insert(room.vertices.end(), {a, b, c, d});
  room.triangles.push_back({{first, first + 1, first + 2}, material});
  room.triangles.push_back({{first, first + 2, first + 3}, material});
}

/// South wall 4 x 2.5 m around a 1.6 x 1.2 m hole, from eight quads as modelling programs write it.
Room wall_with_hole() {
  Room room;
  room.materials.push_back({});
  const std::array<double, 4> x = {0, 1.2, 2.8, 4}, z = {0, 0.9, 2.1, 2.5};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      if (i != 1 || j != 1)
        add_quad(room, {x[i], 0, z[j]}, {x[i], 0, z[j + 1]}, {x[i + 1], 0, z[j + 1]}, {x[i + 1], 0, z[j]});
  return room;
}

double total_area(const PatchMesh& mesh) {
  double sum = 0;
  for (const Patch& p : mesh.patches)
    sum += p.area_m2;
  return sum;
}

double smallest_angle_deg(const Patch& p) {
  double smallest = 180;
  for (int k = 0; k < 3; ++k) {
    const glm::dvec3 u = glm::normalize(p.corner[(k + 1) % 3] - p.corner[k]);
    const glm::dvec3 v = glm::normalize(p.corner[(k + 2) % 3] - p.corner[k]);
    smallest = std::min(smallest, std::acos(glm::dot(u, v)) * 180 / 3.14159265358979);
  }
  return smallest;
}

TEST(Patches, hole_stays_a_hole_and_area_is_exact) {
  const auto mesh = mesh_patches(wall_with_hole(), {.edge_m = 0.2});
  ASSERT_TRUE(mesh) << mesh.error().message();
  EXPECT_EQ(mesh->planes, 1u);
  EXPECT_NEAR(total_area(*mesh), 4 * 2.5 - 1.6 * 1.2, 1e-9);
  for (const Patch& p : mesh->patches) {
    const glm::dvec3 c = (p.corner[0] + p.corner[1] + p.corner[2]) / 3.0 + mesh->origin;
    EXPECT_FALSE(c.x > 1.2 && c.x < 2.8 && c.z > 0.9 && c.z < 2.1);
    EXPECT_GT(smallest_angle_deg(p), 20.0);
    EXPECT_GT(glm::dot(p.normal, glm::cross(p.corner[1] - p.corner[0], p.corner[2] - p.corner[0])), 0.0);
  }
}

TEST(Patches, seams_between_source_faces_at_any_offset_never_lose_a_wall) {
  // The refinement looks source faces up at triangle centroids, which can lie exactly on a seam.
  for (int shift = 0; shift < 20; ++shift) {
    Room room = wall_with_hole();
    for (glm::dvec3& v : room.vertices)
      v = glm::dvec3(v.x + 0.37 * shift, v.y, v.z * (1.0 + 0.01 * shift));
    const auto mesh = mesh_patches(room, {.edge_m = 0.4});
    ASSERT_TRUE(mesh);
    EXPECT_NEAR(total_area(*mesh), (4 * 2.5 - 1.6 * 1.2) * (1.0 + 0.01 * shift), 1e-9) << shift;
  }
}

TEST(Patches, requested_count_is_met_within_five_percent) {
  for (const int target : {500, 2000, 8000}) {
    const auto mesh = mesh_patches(wall_with_hole(), {.target_patches = target});
    ASSERT_TRUE(mesh);
    EXPECT_NEAR(static_cast<double>(mesh->patches.size()) / target, 1.0, 0.05);
  }
}

TEST(Patches, furniture_footprint_becomes_mesh_edges_on_the_floor) {
  Room room;
  room.materials.push_back({});
  add_quad(room, {0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0});
  const double c = std::cos(0.3), s = std::sin(0.3); // a turned box: its corners are not representable exactly
  const auto at = [&](double u, double v, double z) { return glm::dvec3(2 + c * u - s * v, 2 + s * u + c * v, z); };
  const std::array<glm::dvec2, 4> base = {glm::dvec2(-0.5, -0.5), {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}};
  for (int k = 0; k < 4; ++k) {
    const glm::dvec2 p = base[k], q = base[(k + 1) % 4];
    add_quad(room, at(p.x, p.y, 0), at(q.x, q.y, 0), at(q.x, q.y, 1), at(p.x, p.y, 1));
  }
  const auto mesh = mesh_patches(room, {.edge_m = 0.35});
  ASSERT_TRUE(mesh);
  double covered = 0;
  for (const Patch& p : mesh->patches) {
    const glm::dvec3 m = (p.corner[0] + p.corner[1] + p.corner[2]) / 3.0 + mesh->origin - glm::dvec3(2, 2, 0);
    if (std::abs(m.z) < 1e-9 && std::abs(c * m.x + s * m.y) < 0.5 && std::abs(-s * m.x + c * m.y) < 0.5)
      covered += p.area_m2;
  }
  EXPECT_NEAR(covered, 1.0, 1e-9); // exactly the footprint: no patch straddles it
  EXPECT_LT(mesh->patches.size(), 1500u);
}

TEST(Patches, translation_by_a_thousand_kilometres_keeps_the_mesh) {
  Room far = wall_with_hole();
  for (glm::dvec3& v : far.vertices)
    v += glm::dvec3(1048576.0, -2097152.0, 524288.0); // exactly representable shift
  const auto here = mesh_patches(wall_with_hole(), {.edge_m = 0.2}), there = mesh_patches(far, {.edge_m = 0.2});
  ASSERT_TRUE(here && there);
  EXPECT_NEAR(total_area(*here), total_area(*there), 1e-7);
  EXPECT_NEAR(static_cast<double>(here->patches.size()), static_cast<double>(there->patches.size()),
              0.01 * static_cast<double>(here->patches.size()));
}

TEST(Patches, overlapping_faces_of_one_wall_are_counted_once) {
  Room room;
  room.materials.push_back({});
  add_quad(room, {0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {0, 1, 0});
  add_quad(room, {1, 0, 0}, {3, 0, 0}, {3, 1, 0}, {1, 1, 0});
  const auto mesh = mesh_patches(room, {.edge_m = 0.3});
  ASSERT_TRUE(mesh);
  EXPECT_NEAR(total_area(*mesh), 3.0, 1e-9);
}

TEST(Patches, refuses_a_mesh_beyond_the_limit) {
  const auto mesh = mesh_patches(wall_with_hole(), {.edge_m = 0.001});
  ASSERT_FALSE(mesh);
  EXPECT_EQ(mesh.error().code, ErrorCode::limit_exceeded);
}

} // namespace
} // namespace daylit::radiosity
