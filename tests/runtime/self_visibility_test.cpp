#include "runtime/object/self_visibility.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "runtime/object/transfer.h"
#include "runtime/sky/window_sampler.h"
#include "test_scene.h"

namespace daylit {
namespace {

constexpr int kRays = 128, kDirections = 2048;

glm::vec3 direction(int k) {
  const glm::dvec2 u = lattice_point(k, kDirections);
  const double z = 1.0 - 2.0 * u.x, r = std::sqrt(1.0 - z * z), turn = 2.0 * std::numbers::pi * u.y;
  return {r * std::cos(turn), r * std::sin(turn), z};
}

/// A torus and what some of its vertices see past it.
struct Looked {
  ObjectMesh mesh = test::torus(0.2f, 0.12f, 96, 64);
  RayScene rays =
      *RayScene::build(std::vector<glm::dvec3>(mesh.positions.begin(), mesh.positions.end()), mesh.triangles);
  std::vector<std::uint32_t> vertices;
  SelfVisibility visibility;

  Looked() {
    const VertexRays looking(mesh, rays, kRays);
    for (std::uint32_t v = 0; v < mesh.positions.size(); v += 61)
      vertices.push_back(v);
    visibility = SelfVisibility(looking, vertices.size());
    for (std::size_t i = 0; i < vertices.size(); ++i)
      visibility.set(i, false, looking.look(vertices[i], mesh.normals[vertices[i]]));
  }
  SenderSide side(std::size_t i, const glm::mat3& turn = glm::mat3(1.0f)) const {
    return {&visibility, i, false, turn * VertexRays::frame(mesh.normals[vertices[i]])};
  }
};

TEST(SelfVisibility, is_what_rays_in_the_same_directions_find) {
  const Looked s;
  int wrong = 0, hidden = 0, all = 0;
  for (std::size_t i = 0; i < s.vertices.size(); ++i) {
    const std::uint32_t v = s.vertices[i];
    const glm::vec3 from = s.rays.to_local(glm::dvec3(s.mesh.positions[v] + 1e-3f * s.mesh.normals[v]));
    for (int k = 0; k < kDirections; ++k) {
      const glm::vec3 w = direction(k);
      if (glm::dot(w, s.mesh.normals[v]) < 0.05f)
        continue;
      const bool met = s.rays.occluded(from, w, 0.0f, 10.0f);
      wrong += (s.side(i).visible_cosine(w) > 0.0f) == met;
      hidden += met;
      ++all;
    }
  }
  EXPECT_GT(hidden, all / 20) << "the torus hides some of itself";
  EXPECT_LT(wrong, all / 25) << "at the edges of what it hides";
}

TEST(SelfVisibility, leaves_of_the_hemisphere_what_transfer_vectors_leave) {
  const Looked s;
  const auto transfer = compute_transfer(s.mesh);
  const glm::mat3 quarter(glm::vec3(0, 1, 0), glm::vec3(-1, 0, 0), glm::vec3(0, 0, 1));
  double error = 0.0;
  for (std::size_t i = 0; i < s.vertices.size(); ++i)
    for (const glm::mat3& turn : {glm::mat3(1.0f), quarter}) {
      float sum = 0.0f;
      for (int k = 0; k < kDirections; ++k)
        sum += s.side(i, turn).visible_cosine(direction(k));
      const float expected = 1.0f - hidden_fraction((*transfer)[s.vertices[i]].front);
      EXPECT_NEAR(4.0f * sum / kDirections, expected, 0.045f) << "a ray is 0.008, and speaks for up to twice that";
      error += std::fabs(static_cast<double>(4.0f * sum / kDirections - expected));
    }
  EXPECT_LT(error / static_cast<double>(2 * s.vertices.size()), 0.01);
}

TEST(SelfVisibility, of_nothing_hides_nothing) {
  const SelfVisibility open;
  const SenderSide side{&open, 7, true, VertexRays::frame({0, 0, -1})};
  EXPECT_FLOAT_EQ(side.visible_cosine({0, 0, -1}), 1.0f);
  EXPECT_FLOAT_EQ(side.visible_cosine({0, 0, 1}), 0.0f);
}

} // namespace
} // namespace daylit
