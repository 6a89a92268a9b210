#include <cmath>
#include <numbers>
#include <set>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "scene/room/aperture.h"
#include "scene/room/glass.h"
#include "simulate/aperture_sampler.h"
#include "simulate/low_discrepancy.h"
#include "simulate/path_tracer.h"

namespace daylit {
namespace {

constexpr double kPi = std::numbers::pi;

Aperture square_overhead(double half, double height) {
  return {{{-half, -half, height}, {half, -half, height}, {half, half, height}, {-half, half, height}},
          {0, 0, -1},
          Rgb(1.0f)};
}

TEST(LowDiscrepancy, scrambled_points_keep_one_point_in_every_elementary_interval) {
  for (std::uint32_t key = 1; key < 20; ++key)
    for (const int columns : {1, 4, 16, 64}) {
      std::set<int> cells;
      for (std::uint32_t i = 0; i < 64; ++i) {
        const glm::vec2 p = SampleStream(key, i).point(3);
        ASSERT_TRUE(p.x >= 0.0f && p.x < 1.0f && p.y >= 0.0f && p.y < 1.0f);
        const int rows = 64 / columns;
        cells.insert(static_cast<int>(p.x * static_cast<float>(columns)) * rows +
                     static_cast<int>(p.y * static_cast<float>(rows)));
      }
      EXPECT_EQ(cells.size(), 64u) << "key " << key << ", " << columns << " columns";
    }
}

TEST(LowDiscrepancy, different_keys_and_pairs_give_different_points) {
  const glm::vec2 a = SampleStream(1, 5).point(0);
  EXPECT_NE(a, SampleStream(2, 5).point(0));
  EXPECT_NE(a, SampleStream(1, 5).point(1));
  EXPECT_EQ(a, SampleStream(1, 5).point(0));
}

// A corner square of unit cube: the solid angle of one face of a cube seen from its middle is 4 pi / 6.
TEST(ApertureSampler, solid_angle_of_a_cube_face_is_a_sixth_of_the_sphere) {
  const glm::dvec3 a(-1, -1, 1), b(1, -1, 1), c(1, 1, 1), d(-1, 1, 1);
  EXPECT_NEAR(triangle_solid_angle(a, b, c) + triangle_solid_angle(a, c, d), 4.0 * kPi / 6.0, 1e-12);
}

// The mean of a direction that is uniform in solid angle over a polygon is its vector irradiance over its solid angle:
// sum of edge angle x unit edge normal, halved (Lambert).
TEST(ApertureSampler, directions_are_uniform_in_solid_angle) {
  const glm::dvec3 a(-0.4, -1.0, 0.5), b(1.5, -0.2, 0.6), c(0.3, 1.2, 0.4);
  glm::dvec3 expected(0.0);
  for (const auto& [p, q] : {std::pair(a, b), std::pair(b, c), std::pair(c, a)}) {
    const glm::dvec3 n = glm::cross(p, q);
    expected += 0.5 * std::atan2(glm::length(n), glm::dot(p, q)) * glm::normalize(n);
  }
  expected /= triangle_solid_angle(a, b, c);
  glm::dvec3 mean(0.0);
  constexpr int n = 1 << 16;
  for (std::uint32_t i = 0; i < n; ++i)
    mean += sample_triangle_direction(a, b, c, SampleStream(7, i).point(0));
  EXPECT_LT(glm::distance(mean / static_cast<double>(n), expected), 1e-4);
}

TEST(ApertureSampler, density_is_the_density_of_the_samples) {
  const std::vector<Aperture> two = {square_overhead(0.5, 1.0), square_overhead(1.5, 2.0)}; // one behind the other
  const ApertureSampler sampler(two, glm::dvec3(0.0));
  const glm::vec3 point(0.3f, -0.2f, 0.0f);
  double area = 0.0;
  constexpr int n = 1 << 14;
  for (std::uint32_t i = 0; i < n; ++i) {
    const auto s = sampler.sample(point, SampleStream(3, i).point(0));
    ASSERT_TRUE(s);
    EXPECT_NEAR(sampler.density(point, s->direction), s->density, 1e-4 * static_cast<double>(s->density));
    area += 1.0 / static_cast<double>(s->density); // estimates the solid angle of the union
  }
  const glm::dvec3 p(point);
  const auto& c = two[1].corners;
  const double outer =
      triangle_solid_angle(c[0] - p, c[1] - p, c[2] - p) + triangle_solid_angle(c[0] - p, c[2] - p, c[3] - p);
  EXPECT_NEAR(area / n, outer, 2e-3); // the far square covers the near one
}

TEST(ApertureSampler, openings_behind_the_point_give_nothing) {
  const std::vector<Aperture> one = {square_overhead(0.5, 1.0)};
  const ApertureSampler sampler(one, glm::dvec3(0.0));
  EXPECT_FALSE(sampler.sample({0, 0, 2}, {0.5f, 0.5f}));
  EXPECT_EQ(sampler.density({0, 0, 2}, {0, 0, -1}), 0.0f);
}

TEST(ApertureSampler, every_pane_crossed_multiplies_its_transmittance) {
  std::vector<Aperture> two = {square_overhead(0.5, 1.0), square_overhead(0.5, 1.1)};
  two[0].transmittance = Rgb(0.8f, 0.5f, 1.0f);
  two[1].transmittance = Rgb(0.5f);
  const ApertureSampler sampler(two, glm::dvec3(0.0));
  const Rgb t = sampler.transmittance({0, 0, 0}, {0, 0, 1});
  EXPECT_FLOAT_EQ(t.r, 0.4f);
  EXPECT_FLOAT_EQ(t.g, 0.25f);
  EXPECT_EQ(sampler.transmittance({0, 0, 0}, {1, 0, 0}), Rgb(1.0f));
}

TEST(ApertureSampler, clear_glass_lets_through_what_the_slab_does_at_the_angle_of_the_ray) {
  std::vector<Aperture> pane = {square_overhead(5.0, 1.0)};
  pane[0].transmittance = Rgb(0.9f);
  pane[0].refractive_index = 1.52f;
  const ApertureSampler sampler(pane, glm::dvec3(0.0));
  for (const double degrees : {0.0, 45.0, 75.0}) {
    const double angle = degrees * kPi / 180;
    const glm::dvec3 w(std::sin(angle), 0, std::cos(angle));
    const double expected = 0.9 * clear_slab_transmittance(std::cos(angle), 1.52);
    EXPECT_NEAR(static_cast<double>(sampler.transmittance({0, 0, 0}, glm::vec3(w)).g), expected, 1e-6) << degrees;
    EXPECT_NEAR(static_cast<double>(aperture_transmittance(pane, glm::dvec3(0.0), w, 100.0).g), expected, 1e-6);
  }
  const auto sample = sampler.sample({0, 0, 0}, {0.3f, 0.8f});
  ASSERT_TRUE(sample);
  EXPECT_EQ(sample->transmittance, sampler.transmittance({0, 0, 0}, sample->direction));
}

TEST(ApertureSampler, beam_density_is_one_over_the_cross_section) {
  const std::vector<Aperture> one = {square_overhead(0.5, 1.0)};
  const ApertureSampler sampler(one, glm::dvec3(0.0));
  const glm::vec3 sun = glm::normalize(glm::vec3(0.3f, 0.0f, 1.0f));
  EXPECT_NEAR(sampler.beam_density({0, 0, 0}, sun), 1.0 / static_cast<double>(sun.z), 1e-5);
  EXPECT_EQ(sampler.beam_density({3, 0, 0}, sun), 0.0f);
  EXPECT_FALSE(sampler.sample_beam(-sun, {0.5f, 0.5f})); // from inside
}

TEST(CosineSample, mean_cosine_is_two_thirds) {
  double sum = 0.0;
  constexpr int n = 4096;
  const glm::vec3 normal = glm::normalize(glm::vec3(1, -2, 0.5f));
  for (std::uint32_t i = 0; i < n; ++i)
    sum += static_cast<double>(glm::dot(normal, sample_cosine(normal, SampleStream(11, i).point(0))));
  EXPECT_NEAR(sum / n, 2.0 / 3.0, 1e-4);
}

} // namespace
} // namespace daylit
