#include "runtime/object/self_exchange.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "object_shapes.h"
#include "runtime/indirect/light_in_box.h"
#include "runtime/object/bounds.h"

namespace daylit {
namespace {

constexpr double kPi = std::numbers::pi;

/// A mesh with what is known of it.
struct Shape {
  ObjectMesh mesh;
  RayScene rays;
  std::vector<VertexTransfer> transfer;
  MeshSenders senders;
  SelfExchange exchange;
};

Shape shape(ObjectMesh mesh) {
  auto rays = RayScene::build(std::vector<glm::dvec3>(mesh.positions.begin(), mesh.positions.end()), mesh.triangles);
  auto transfer = compute_transfer(mesh);
  MeshSenders senders = find_senders(mesh, {0, 0, 1});
  auto exchange = SelfExchange::make(mesh, *rays, senders, false);
  return {std::move(mesh), std::move(*rays), std::move(*transfer), std::move(senders), std::move(*exchange)};
}

// Inside a sphere every point sees every other with the form factor area / (4 pi R^2). Under a sky of radiance 1 the
// opening sends pi open to each point, and the wall rho (1 - open) of what it gets: E = pi open / (1 - rho (1 - open)).
TEST(SelfExchange, the_inside_of_an_open_sphere_is_lit_by_all_reflections) {
  constexpr float kOpen = 0.25f;
  const Shape s = shape(test::bowl(kOpen));
  LightField field{{Sh9Rgb{}}};
  field.probe[0][0] = Rgb(1.0f / 0.28209479f); // radiance 1 from everywhere
  VertexProbes one;
  one.weight[0] = 1.0f;
  one.count = 1;
  const std::vector<VertexProbes> probes(s.mesh.positions.size(), one);
  for (const float rho : {0.2f, 0.6f, 0.85f}) {
    const std::vector<Rgb> reflectance(s.mesh.positions.size(), Rgb(rho));
    const auto from_sky = relight_vertices(light_between(field, probes), s.transfer, reflectance);
    auto radiance = from_sky;
    s.exchange.reflect(std::vector<TwoSided>(radiance.size()), from_sky, reflectance, radiance);
    double sum = 0.0;
    int count = 0;
    for (std::size_t i = 0; i < radiance.size(); ++i)
      if (s.mesh.positions[i].z < 0.4f && s.mesh.positions[i].z > -0.99f) { // not beside the rim, where facets count
        EXPECT_NEAR(radiance[i].front.r, rho, 0.01f * rho);                 // convex: all of the sky
        sum += static_cast<double>(radiance[i].back.r);
        ++count;
      }
    const auto expected = static_cast<double>(rho * kOpen / (1.0f - rho * (1.0f - kOpen)));
    EXPECT_NEAR(sum / count, expected, 0.04 * expected) << "reflectance " << rho;
  }
}

/// Two squares of 1 m, `gap` apart, that face each other; the first vertex of each is the middle of its square.
ObjectMesh facing_squares(float gap) {
  ObjectMesh mesh;
  constexpr int kSide = 20;
  for (const float side : {0.0f, 1.0f}) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (int j = 0; j <= kSide; ++j)
      for (int i = 0; i <= kSide; ++i) {
        mesh.positions.emplace_back(static_cast<float>(i) / kSide - 0.5f, static_cast<float>(j) / kSide - 0.5f,
                                    side * gap);
        mesh.normals.emplace_back(0.0f, 0.0f, side == 0.0f ? 1.0f : -1.0f);
        mesh.reflectance.emplace_back(0.5f);
      }
    for (std::uint32_t j = 0; j < kSide; ++j)
      for (std::uint32_t i = 0; i < kSide; ++i) {
        const std::uint32_t a = first + j * (kSide + 1) + i, b = a + kSide + 1;
        for (auto t : {std::array{a, a + 1, b + 1}, std::array{a, b + 1, b}}) {
          if (side == 1.0f)
            std::swap(t[1], t[2]);
          mesh.triangles.push_back(t);
        }
      }
  }
  return mesh;
}

/// From a point above the corner of a parallel rectangle a x b, in units of the distance (Howell B-3).
double to_rectangle(double a, double b) {
  const double u = std::sqrt(1 + a * a), v = std::sqrt(1 + b * b);
  return (a / u * std::atan(b / u) + b / v * std::atan(a / v)) / (2 * kPi);
}

TEST(SelfExchange, squares_light_each_other_as_their_form_factor_says_and_not_their_backs) {
  for (const float gap : {0.2f, 1.0f}) {
    const Shape s = shape(facing_squares(gap));
    std::vector<TwoSided> radiance(s.mesh.positions.size());
    const std::size_t half = radiance.size() / 2;
    for (std::size_t i = half; i < radiance.size(); ++i)
      radiance[i] = {Rgb(1.0f, 2.0f, 3.0f), Rgb(100.0f)}; // the far square's back is not seen
    const auto e = s.exchange.irradiance(radiance);
    const double expected = 4 * kPi * to_rectangle(0.5 / static_cast<double>(gap), 0.5 / static_cast<double>(gap));
    EXPECT_NEAR(e[half / 2].front.r, expected, 0.02 * kPi) << gap;
    EXPECT_NEAR(e[half / 2].front.b, 3 * expected, 0.06 * kPi) << gap;
    EXPECT_EQ(e[half / 2].back, Rgb(0.0f));
    EXPECT_EQ(e[half + half / 2].front, Rgb(0.0f)) << "the near one is dark";
  }
}

TEST(SelfExchange, a_torus_that_shines_everywhere_lights_what_of_each_vertex_it_hides) {
  const Shape s = shape(test::torus(0.15f, 0.06f));
  const std::vector<TwoSided> radiance(s.mesh.positions.size(), TwoSided{Rgb(1.0f), Rgb(0.0f)});
  const auto e = s.exchange.irradiance(radiance);
  double square = 0.0;
  for (std::size_t i = 0; i < e.size(); ++i) {
    const double hidden = kPi * static_cast<double>(hidden_fraction(s.transfer[i].front));
    EXPECT_NEAR(e[i].front.g, hidden, 0.06 * kPi);
    square += std::pow(static_cast<double>(e[i].front.g) - hidden, 2);
  }
  EXPECT_LT(std::sqrt(square / static_cast<double>(e.size())), 0.015 * kPi);
}

TEST(SelfExchange, few_senders_of_a_dense_mesh_light_each_other_as_many_do) {
  const Shape all = shape(test::torus(0.15f, 0.06f, 100, 80));
  const ObjectMesh& mesh = all.mesh;
  const MeshSenders few = find_senders(mesh, {0, 0, 1}, 6000); // cells of a fortieth
  ASSERT_LT(few.vertex.size(), mesh.positions.size() * 2 / 3);
  const auto shines = [&](std::uint32_t v) { return TwoSided{Rgb(2.0f + std::sin(20.0f * mesh.positions[v].x)), {}}; };
  const auto irradiance = [&](const SelfExchange& exchange, const std::vector<std::uint32_t>& vertices) {
    std::vector<TwoSided> radiance;
    for (const std::uint32_t v : vertices)
      radiance.push_back(shines(v));
    return exchange.irradiance(radiance);
  };
  const auto coarse = irradiance(*SelfExchange::make(mesh, all.rays, few, false), few.vertex),
             fine = irradiance(all.exchange, all.senders.vertex);
  Bounds box;
  for (const glm::vec3& p : mesh.positions)
    box.include(glm::dvec3(p));
  LightInBox light(box);
  for (std::size_t i = 0; i < coarse.size(); ++i) {
    const std::uint32_t v = few.vertex[i];
    light.add(glm::dvec3(mesh.positions[v]), {}, {coarse[i], hidden_fraction(all.transfer[v].front), 0.0f});
  }
  light.turn(glm::mat3(1.0f));
  double square = 0.0, level = 0.0;
  for (std::uint32_t v = 0; v < mesh.positions.size(); ++v) {
    const double found = kPi * static_cast<double>(hidden_fraction(all.transfer[v].front) *
                                                   light.at(glm::dvec3(mesh.positions[v])).of_object.front.g);
    square += std::pow(found - static_cast<double>(fine[v].front.g), 2);
    level += static_cast<double>(fine[v].front.g);
  }
  const auto count = static_cast<double>(mesh.positions.size());
  EXPECT_LT(std::sqrt(square / count), 0.12 * level / count);
}

} // namespace
} // namespace daylit
