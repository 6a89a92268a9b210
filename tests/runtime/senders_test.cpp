#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "runtime/indirect/light_in_box.h"
#include "runtime/object/bounds.h"
#include "runtime/object/placed_parts.h"
#include "runtime/object/senders.h"
#include "test_scene.h"

namespace daylit {
namespace {

constexpr glm::vec3 kUp(0.0f, 0.0f, 1.0f);

int octant(const glm::vec3& n) { return (n.x < 0 ? 1 : 0) + (n.y < 0 ? 2 : 0) + (n.z < 0 ? 4 : 0); }

TEST(Senders, of_a_small_mesh_are_all_its_vertices) {
  const ObjectMesh mesh = test::torus(0.2f, 0.1f, 100, 60);
  const MeshSenders senders = find_senders(mesh, kUp);
  ASSERT_LE(mesh.positions.size(), kMostSenders);
  for (std::uint32_t v = 0; v < senders.of.size(); ++v) {
    EXPECT_EQ(senders.of[v], v);
    EXPECT_EQ(senders.vertex[v], v);
  }
}

TEST(Senders, of_a_dense_mesh_are_few_and_lie_beside_those_they_send_for) {
  for (const int side : {400, 500}) {
    const ObjectMesh mesh = test::torus(0.2f, 0.1f, side, side);
    ASSERT_GT(mesh.positions.size(), kMostSenders);
    const MeshSenders senders = find_senders(mesh, kUp);
    for (std::uint32_t v = 0; v < senders.of.size(); ++v) {
      const std::uint32_t sender = senders.vertex[senders.of[v]];
      EXPECT_EQ(senders.of[sender], senders.of[v]);
      EXPECT_EQ(octant(mesh.normals[v]), octant(mesh.normals[sender]));
      EXPECT_LE(glm::length(mesh.positions[v] - mesh.positions[sender]), std::sqrt(3.0f) * 0.6f / 40.0f + 1e-6f);
    }
    EXPECT_TRUE(std::ranges::is_sorted(senders.vertex));
    EXPECT_LT(senders.vertex.size(), 12000u) << "however dense the mesh is";
    EXPECT_GT(senders.vertex.size(), 1000u);
  }
}

TEST(Senders, at_the_foot_are_four_times_as_dense_but_not_too_many) {
  const ObjectMesh mesh = test::torus(0.2f, 0.1f, 900, 500);
  // On its side, and flat: then many lie near the floor.
  for (const glm::vec3& up : {glm::vec3(1, 0, 0), kUp}) {
    const MeshSenders senders = find_senders(mesh, up);
    const float lowest = up.x > 0.0f ? -0.3f : -0.1f, cells = up.x > 0.0f ? 160.0f : 80.0f;
    std::vector<std::uint32_t> at_foot;
    for (std::uint32_t v = 0; v < senders.of.size(); ++v) {
      const float height = glm::dot(up, mesh.positions[v]) - lowest;
      EXPECT_FALSE(senders.at_foot[v] && height > 0.04f * 0.6f + 1e-4f);
      EXPECT_TRUE(senders.at_foot[v] || height > 0.04f * 0.6f - 1e-4f || height < 0.002f);
      if (!senders.at_foot[v])
        continue;
      at_foot.push_back(senders.of[v]);
      EXPECT_LE(glm::length(mesh.positions[v] - mesh.positions[senders.vertex[senders.of[v]]]),
                std::sqrt(3.0f) * 0.6f / cells + 1e-5f);
    }
    std::ranges::sort(at_foot);
    at_foot.erase(std::ranges::unique(at_foot).begin(), at_foot.end());
    EXPECT_LE(at_foot.size(), 4096u);
    EXPECT_GT(at_foot.size(), 500u);
  }
}

TEST(Senders, of_a_mesh_from_which_fewer_are_wanted_lie_further_apart) {
  const ObjectMesh mesh = test::torus(0.2f, 0.1f, 100, 80);
  const MeshSenders senders = find_senders(mesh, kUp, kMostMirrorSenders);
  const auto at_foot = [&](std::uint32_t v) { return senders.at_foot[v] != 0; };
  const auto foot = static_cast<std::size_t>(std::ranges::count_if(senders.vertex, at_foot));
  EXPECT_LE(foot, kMostMirrorSenders);
  EXPECT_LE(senders.vertex.size() - foot, kMostMirrorSenders);
  EXPECT_GT(senders.vertex.size(), 300u);
  for (std::uint32_t v = 0; v < senders.of.size(); ++v)
    EXPECT_LE(glm::length(mesh.positions[v] - mesh.positions[senders.vertex[senders.of[v]]]),
              std::sqrt(3.0f) * 0.6f / 10.0f + 1e-6f);
}

TEST(Senders, of_a_placed_part_are_the_first_vertices_of_their_places) {
  const std::vector<glm::vec3> positions(5, glm::vec3(0.0f));
  const std::vector<std::uint32_t> places{5, 6, 5, 7, 7};
  PlacedPart some, all;
  some.positions = all.positions = positions;
  some.sender = places;
  const PlacedParts parts({some, all});
  EXPECT_EQ(parts.senders(0), (std::vector<std::uint32_t>{0, 1, 3}));
  EXPECT_EQ(parts.senders(1), (std::vector<std::uint32_t>{0, 1, 2, 3, 4}));
}

TEST(Senders, of_a_foot_too_large_for_finer_cells_are_as_elsewhere) {
  ObjectMesh mesh = test::torus(0.2f, 0.1f, 900, 500);
  for (glm::vec3& p : mesh.positions)
    p.z *= 0.05f; // flat: all of it is foot
  const MeshSenders senders = find_senders(mesh, kUp);
  EXPECT_TRUE(std::ranges::none_of(senders.at_foot, [](std::uint8_t foot) { return foot != 0; }))
      << "nobody takes the light of a sender a fortieth away";
}

TEST(LightInBox, a_gradient_between_senders_is_kept_to_a_twentieth_of_its_range) {
  const ObjectMesh mesh = test::torus(0.2f, 0.1f, 300, 200);
  Bounds box;
  for (const glm::vec3& p : mesh.positions)
    box.include(glm::dvec3(p));
  LightInBox light(box);
  const auto truth = [](const glm::vec3& x) { return 2.0f + 3.0f * x.x - 1.0f * x.y + 2.0f * x.z; };
  for (const std::uint32_t v : find_senders(mesh, kUp).vertex) {
    Sh9Rgb here{};
    here[2] = Rgb(truth(mesh.positions[v]));
    light.add(glm::dvec3(mesh.positions[v]), here, {});
  }
  light.turn(glm::mat3(1.0f));
  double square = 0.0;
  for (const glm::vec3& p : mesh.positions) {
    const float found = light.at(glm::dvec3(p)).from_room[2].g;
    EXPECT_NEAR(found, truth(p), 0.1f) << "of a range of 2";
    square += static_cast<double>((found - truth(p)) * (found - truth(p)));
  }
  EXPECT_LT(std::sqrt(square / static_cast<double>(mesh.positions.size())), 0.02) << "of a range of 2";
}

TEST(LightInBox, is_turned_into_the_frame_of_a_turned_box) {
  // In a box turned by a quarter about z, light from the world's x comes along its own -y.
  const glm::mat3 quarter(glm::vec3(0, 1, 0), glm::vec3(-1, 0, 0), glm::vec3(0, 0, 1));
  Bounds box;
  box.include(glm::dvec3(-1.0));
  box.include(glm::dvec3(1.0));
  LightInBox light(box);
  Sh9Rgb from_x{};
  from_x[3] = Rgb(1.0f);
  light.add(glm::dvec3(0.1), from_x, {});
  light.turn(quarter);
  EXPECT_NEAR(light.at(glm::dvec3(0.1)).from_room[1].g, -1.0f, 1e-5f);
  EXPECT_NEAR(light.at(glm::dvec3(0.1)).from_room[3].g, 0.0f, 1e-5f);
}

TEST(PointsAround, a_dense_mesh_lies_in_the_box_of_few_points_around_it) {
  const ObjectMesh mesh = test::torus(0.2f, 0.1f, 400, 300);
  const auto points = points_around(mesh.positions);
  EXPECT_LT(points.size(), mesh.positions.size() / 3);
  const RenderCamera camera = test::look_at({1.0, 0.4, 0.5}, {0.0, 0.0, 0.0}, 200, 180, 0.6);
  const PixelBox exact = projected_box(camera, glm::dvec3(0.0), mesh.positions),
                 around = projected_box(camera, glm::dvec3(0.0), points);
  EXPECT_EQ(around.common(exact), exact);
  EXPECT_LE(around.width(), exact.width() + 12);
  EXPECT_LE(around.height(), exact.height() + 12);
}

} // namespace
} // namespace daylit
