#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "radiosity/coefficients.h"
#include "radiosity/detail/sampling.h"
#include "radiosity/solve.h"
#include "scene/sky/sky_partition.h"
#include "sh/band4.h"
#include "sh/sh9.h"
#include "tests/radiosity/solved_room.h"

namespace daylit::radiosity {
namespace {

using daylit::testing::add_box;
using daylit::testing::grey_room;
using daylit::testing::room_with_window_hole;
using testing::coloured_room;
using testing::kSilent;
using testing::prepare;
using testing::seed_at;
using testing::Solved;
constexpr double kPi = std::numbers::pi;

TEST(Gather, constant_radiance_has_only_the_zeroth_coefficient) {
  Room room = grey_room(0.5f);
  add_box(room, {0, 0, 0}, {4, 3, 2.5}, 0b111111u, true);
  const Solved s = prepare(room, 300, seed_at({2, 1.5, 1}));
  Radiosity b{s.set.patches.size(), 3, std::vector<float>(s.set.patches.size() * 3, static_cast<float>(kPi))}; // L = 1
  const std::array<glm::dvec3, 2> points = {glm::dvec3(0, 0, 0), glm::dvec3(1.2, -0.7, 0.4)};
  const auto c = gather_coefficients(*gather_hits(points, s.set, s.mesh, s.scene, {}, kSilent), b, kSilent);
  ASSERT_TRUE(c);
  for (std::size_t p = 0; p < 2; ++p)
    for (std::size_t l = 0; l < 9; ++l)
      EXPECT_NEAR((*c)[(p * 9 + l) * 3], l == 0 ? std::sqrt(4 * kPi) : 0.0, 5e-3) << l;
}

TEST(Gather, weights_are_those_of_the_rays_one_by_one) {
  const Solved s = prepare(room_with_window_hole(0.5f), 300);
  const std::array<glm::dvec3, 3> points = {glm::dvec3(0, 0, 0.3), glm::dvec3(1.2, -0.7, 0.4),
                                            glm::dvec3(-0.9, 0.8, -0.2)};
  const int rays = 1000; // no multiple of a packet
  const RayFan fan = RayFan::of(rays);
  const auto hits = gather_hits(points, s.set, s.mesh, s.scene, {.rays = rays}, kSilent, 2 * rays); // one again
  ASSERT_TRUE(hits);
  const std::size_t n = s.set.patches.size();
  const auto values = [](Bands bands, const glm::vec3& d) {
    if (bands != Bands::axes)
      return bands == Bands::low ? sh::evaluate9(d) : sh::evaluate_band4(d);
    const auto front = [](float x) { return std::max(x, 0.0f); };
    return std::array{front(d.x), front(-d.x), front(d.y), front(-d.y), front(d.z), front(-d.z), 0.0f, 0.0f, 0.0f};
  };
  for (std::size_t number = 0; number < 3 * points.size(); ++number) {
    const std::size_t p = number / 3;
    const Bands bands = std::array{Bands::low, Bands::fourth, Bands::axes}[number % 3];
    const double angle = 2 * kPi * random_shift(p).y;
    const auto c = float(std::cos(angle)), t = float(std::sin(angle));
    std::vector<float> expected(9 * n, 0.0f), weights(9 * n);
    for (const glm::vec3& d : fan.direction) {
      const glm::vec3 ray(d.x * c - d.y * t, d.x * t + d.y * c, d.z); // turned about z
      RayHit hit;
      if (!s.scene.closest(s.scene.to_local(points[p]), ray, 0, 1e9f, hit))
        continue;
      if (const std::int32_t met = s.set.hit(s.mesh, hit.triangle, ray); met >= 0)
        for (std::size_t l = 0; l < 9; ++l)
          expected[l * n + static_cast<std::size_t>(met)] += float(4.0 / rays) * values(bands, ray)[l];
    }
    hits->weights(p, weights.data(), bands);
    int other = 0; // a ray along an edge may fall to either side
    for (std::size_t e = 0; e < n; ++e) {
      if (std::abs(weights[e] - expected[e]) > 1e-6f && ++other)
        continue;
      for (std::size_t l = 0; l < 9; ++l)
        ASSERT_NEAR(weights[l * n + e], expected[l * n + e], 1e-6f) << "point " << p << " patch " << e;
    }
    EXPECT_LE(other, 2);
  }
}

TEST(Gather, irradiance_to_order_four_is_closer_to_the_cosine_sum_over_the_rays) {
  const Solved s = prepare(room_with_window_hole(0.5f), 300);
  const std::size_t n = s.set.patches.size();
  Radiosity b{n, 3, std::vector<float>(n * 3, 0.01f)};
  for (std::size_t e = 0; e < n; e += 40) // bright facets
    std::fill_n(b.b.begin() + static_cast<std::ptrdiff_t>(3 * e), 3, 10.0f);
  const std::array<glm::dvec3, 3> points = {glm::dvec3(0, 0, 0.3), glm::dvec3(1.2, -0.7, 0.4),
                                            glm::dvec3(-0.9, 0.8, -0.2)};
  const auto hits = gather_hits(points, s.set, s.mesh, s.scene, {.rays = 4096}, kSilent);
  ASSERT_TRUE(hits);
  const auto low = gather_coefficients(*hits, b, kSilent),
             fourth = gather_coefficients(*hits, b, kSilent, Bands::fourth);
  ASSERT_TRUE(low && fourth);
  const RayFan fan = RayFan::of(4096);
  double nine = 0, all = 0;
  for (std::size_t p = 0; p < points.size(); ++p) {
    const double angle = 2 * kPi * random_shift(p).y;
    const auto c = float(std::cos(angle)), t = float(std::sin(angle));
    std::vector<std::pair<glm::vec3, double>> seen; // radiosity by direction
    for (const glm::vec3& d : fan.direction) {
      const glm::vec3 ray(d.x * c - d.y * t, d.x * t + d.y * c, d.z);
      RayHit hit;
      if (!s.scene.closest(s.scene.to_local(points[p]), ray, 0, 1e9f, hit))
        continue;
      if (const std::int32_t met = s.set.hit(s.mesh, hit.triangle, ray); met >= 0)
        seen.emplace_back(ray, b.b[3 * std::size_t(met)]);
    }
    for (const glm::vec3& normal : RayFan::of(100).direction) {
      double exact = 0, e2 = 0, e4 = 0;
      for (const auto& [ray, radiosity] : seen)
        exact += std::max(0.0, double(glm::dot(ray, normal))) * radiosity * 4.0 / 4096;
      const auto y = sh::evaluate9(normal), y4 = sh::evaluate_band4(normal);
      for (std::size_t l = 0; l < 9; ++l) {
        e2 += double(sh::kClampedCosine9<float>[l] * y[l] * (*low)[(p * 9 + l) * 3]);
        e4 += sh::kClampedCosineBand4<double> * double(y4[l] * (*fourth)[(p * 9 + l) * 3]);
      }
      nine += (e2 - exact) * (e2 - exact);
      all += (e2 + e4 - exact) * (e2 + e4 - exact);
    }
  }
  EXPECT_LT(std::sqrt(all), 0.6 * std::sqrt(nine));
}

TEST(Adjoint, volume_to_light_equals_light_to_volume) {
  const Solved s = prepare(coloured_room(), 500);
  const auto light = first_bounce(s.set, s.mesh, s.scene, s.apertures, *SkyPartition::uniform(64), kSilent);
  const auto b = solve_radiosity(s.set, s.exchange, *light, {.tolerance = 1e-6}, kSilent);
  ASSERT_TRUE(b);
  const std::array<glm::dvec3, 2> points = {glm::dvec3(0, 0, 0.3), glm::dvec3(1.2, -0.7, 0.4)};
  const GatherHits hits = *gather_hits(points, s.set, s.mesh, s.scene, {}, kSilent);
  const auto forward = gather_coefficients(hits, *b, kSilent);
  SolveReport report;
  const auto adjoint = adjoint_coefficients(hits, s.set, s.exchange, *light, {.tolerance = 1e-6}, kSilent, &report);
  ASSERT_TRUE(forward && adjoint);
  ASSERT_EQ(forward->size(), adjoint->size());
  EXPECT_EQ(report.channels, 3);
  float largest = 0;
  for (const float x : *forward)
    largest = std::max(largest, std::abs(x));
  for (std::size_t k = 0; k < forward->size(); ++k)
    ASSERT_NEAR((*forward)[k], (*adjoint)[k], 2e-6f * largest) << k;
}

TEST(Gather, rays_that_are_not_kept_are_traced_again_to_the_same_bits) {
  const Solved s = prepare(coloured_room(), 300);
  const std::array<glm::dvec3, 3> points = {glm::dvec3(0, 0, 0.3), glm::dvec3(1.2, -0.7, 0.4), glm::dvec3(0.5, 1, 1)};
  std::vector<float> kept(9 * s.set.patches.size()), again(kept.size());
  const GatherHits all = *gather_hits(points, s.set, s.mesh, s.scene, {}, kSilent);
  for (const std::size_t most : {std::size_t{0}, std::size_t{2048}, std::size_t{4200}}) { // bytes, of 2,048 a point
    const GatherHits some = *gather_hits(points, s.set, s.mesh, s.scene, {}, kSilent, most);
    ASSERT_EQ(some.points(), 3u);
    for (std::size_t p = 0; p < 3; ++p) {
      all.weights(p, kept.data());
      some.weights(p, again.data());
      ASSERT_EQ(kept, again) << most << " " << p;
    }
  }
}

TEST(PatchNumbers, come_back_as_they_were_put_in_16_bits_and_in_32) {
  for (const std::size_t patches : {std::size_t{65535}, std::size_t{65536}}) {
    PatchNumbers numbers(patches);
    numbers.resize(6);
    const std::array<std::int32_t, 4> some = {-1, 0, 32768, static_cast<std::int32_t>(patches) - 1};
    numbers.put(2, some);
    std::array<std::int32_t, 4> back{};
    numbers.get(2, back);
    EXPECT_EQ(back, some);
    EXPECT_EQ(numbers.size(), 6u);
    EXPECT_EQ(PatchNumbers::bytes_each(patches), patches == 65535 ? 2u : 4u);
  }
}

/// In the zeroth coefficient.
float weight_of(const GatherHits& hits, std::size_t point, std::size_t patch) {
  std::vector<float> rows(9 * hits.patches());
  hits.weights(point, rows.data());
  return rows[patch];
}

TEST(Gather, sixteen_times_the_rays_of_a_point_are_a_finer_lattice_and_leave_other_points_alone) {
  const Solved s = prepare(coloured_room(), 1500);
  const std::array<glm::dvec3, 2> points = {glm::dvec3(0, 0, 0.3), glm::dvec3(0.9, -0.7, 0.4)};
  constexpr int kRays = 256;
  const GatherHits once = *gather_hits(points, s.set, s.mesh, s.scene, {.rays = kRays}, kSilent),
                   exact = *gather_hits(points, s.set, s.mesh, s.scene, {.rays = 1000 * kRays}, kSilent);
  GatherHits more = once, again = *gather_hits(points, s.set, s.mesh, s.scene, {.rays = kRays}, kSilent, 0);
  const std::vector<std::uint16_t> wanted{0, 15};
  ASSERT_TRUE(more.add_rays(wanted, kSilent));
  ASSERT_TRUE(again.add_rays(wanted, kSilent));
  double few = 0, many = 0;
  for (std::size_t e = 0; e < s.set.patches.size(); e += 20) {
    EXPECT_EQ(weight_of(more, 0, e), weight_of(once, 0, e));
    EXPECT_EQ(weight_of(more, 1, e), weight_of(again, 1, e));
    few += std::pow(weight_of(once, 1, e) - weight_of(exact, 1, e), 2);
    many += std::pow(weight_of(more, 1, e) - weight_of(exact, 1, e), 2);
  }
  EXPECT_LT(std::sqrt(many), std::sqrt(few) / 6); // sixteen random fans: a quarter
}

TEST(Gather, moments_are_mean_and_variance_of_the_rays) {
  const Solved s = prepare(coloured_room(), 300);
  const std::array<glm::dvec3, 1> points = {glm::dvec3(0, 0, 0.3)};
  GatherHits hits = *gather_hits(points, s.set, s.mesh, s.scene, {}, kSilent);
  ASSERT_TRUE(hits.add_rays(std::vector<std::uint16_t>{2}, kSilent));
  const std::vector<float> three(s.set.patches.size(), 3.0f);
  std::vector<float> rows(9 * hits.patches());
  hits.weights(0, rows.data());
  double seen = 0; // of the rays, some leave
  for (std::size_t e = 0; e < hits.patches(); ++e)
    seen += double(rows[e]) * std::sqrt(4 * kPi) / 4;
  const auto [mean, variance] = hits.moments(0, three);
  EXPECT_NEAR(mean, 3 * seen, 1e-4);
  EXPECT_NEAR(variance, 9 * seen - 9 * seen * seen, 1e-4);
}

TEST(Gather, tracing_says_how_far_it_is_and_can_be_stopped) {
  const Solved s = prepare(coloured_room(), 300);
  const std::vector<glm::dvec3> points(256, glm::dvec3(0.2, 0.1, 0.4));
  std::atomic<double> last{0};
  ASSERT_TRUE(gather_hits(points, s.set, s.mesh, s.scene, {.rays = 16}, [&](const std::string&, double share) {
    last = std::max(last.load(), share);
    return true;
  }));
  EXPECT_EQ(last, 1.0);
  EXPECT_FALSE(
      gather_hits(points, s.set, s.mesh, s.scene, {.rays = 16}, [](const std::string&, double) { return false; }));
}

} // namespace
} // namespace daylit::radiosity
