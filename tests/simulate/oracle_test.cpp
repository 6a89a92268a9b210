#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "scene/sky/direct_sky.h"
#include "simulate/irradiance.h"
#include "tests/simulate/truth_cases.h"

namespace daylit {
namespace {

constexpr double kPi = std::numbers::pi;

SkyModel uniform_sky(float radiance) {
  SkyModel sky;
  sky.kind = SkyModel::Kind::uniform;
  sky.zenith_radiance = sky.ground_radiance = Rgb(radiance);
  sky.ground_albedo = -1.0f;
  return sky;
}

/// Unit cube, open at y = 0, all surfaces of one reflectance.
Room open_cube(float reflectance) {
  Room room;
  for (int k = 0; k < 8; ++k)
    room.vertices.emplace_back(k & 1, (k >> 1) & 1, (k >> 2) & 1);
  room.materials = {{"grey", Rgb(reflectance), Rgb(1.0f), false}};
  for (const std::array<std::uint32_t, 4> q :
       {std::array<std::uint32_t, 4>{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 2, 6, 4}, {1, 5, 7, 3}, {2, 3, 7, 6}}) {
    room.triangles.push_back({{q[0], q[1], q[2]}, 0});
    room.triangles.push_back({{q[0], q[2], q[3]}, 0});
  }
  return room;
}

const std::vector<Aperture> kOpenFace = {{{{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1}}, {0, 1, 0}, Rgb(1.0f)}};

double relative_spread(const IrradianceEstimate& e, double expected, int channel = 1) {
  return (static_cast<double>(e.value[channel]) - expected) / static_cast<double>(e.standard_error[channel]);
}

TEST(Oracle, open_sky_of_radiance_one_gives_pi) {
  const auto scene = TraceScene::make(open_cube(0.5f), {}, SkyLight(uniform_sky(1.0f))); // no opening is listed
  ASSERT_TRUE(scene);
  const Receiver above{{0.5, 0.5, 5.0}, {0, 0, 1}};
  const auto e = trace_irradiance(*scene, std::span(&above, 1), {.samples = 64, .direct = true});
  ASSERT_TRUE(e);
  EXPECT_NEAR((*e)[0].value.r, kPi, 1e-5);
}

// Parallel rectangle with a corner overhead: F = (A/sqrt(1+A2) atan(B/sqrt(1+A2)) + B/sqrt(1+B2)
// atan(A/sqrt(1+B2)))/2pi.
double corner_factor(double a, double b) {
  const double p = std::sqrt(1.0 + a * a), q = std::sqrt(1.0 + b * b);
  return (a / p * std::atan(b / p) + b / q * std::atan(a / q)) / (2.0 * kPi);
}

TEST(Oracle, light_through_an_opening_is_pi_l_times_its_form_factor) {
  const auto scene = TraceScene::make(open_cube(0.0f), kOpenFace, SkyLight(uniform_sky(2.0f)));
  ASSERT_TRUE(scene);
  const Receiver facing{{0.3, 0.6, 0.2}, {0, -1, 0}};
  const double c = 0.6;
  const double factor = corner_factor(0.3 / c, 0.2 / c) + corner_factor(0.7 / c, 0.2 / c) +
                        corner_factor(0.3 / c, 0.8 / c) + corner_factor(0.7 / c, 0.8 / c);
  const auto e = trace_irradiance(*scene, std::span(&facing, 1), {.samples = 32768, .indirect = false, .direct = true});
  ASSERT_TRUE(e);
  EXPECT_NEAR((*e)[0].value.g, 2.0 * kPi * factor, 2e-3 * 2.0 * kPi * factor);
  EXPECT_NEAR(relative_spread((*e)[0], 2.0 * kPi * factor), 0.0, 4.5);
}

// The oracle and the quadrature of daylit-probe share the pane's formula only.
TEST(Oracle, oblique_light_through_clear_glass_agrees_with_direct_sky) {
  std::vector<Aperture> pane = kOpenFace;
  pane[0].refractive_index = 1.52f;
  const Room room = open_cube(0.0f);
  const auto scene = TraceScene::make(room, pane, SkyLight(uniform_sky(1.0f)));
  ASSERT_TRUE(scene);
  const RayScene rays = *RayScene::build(room);
  const Sky sky(uniform_sky(1.0f));
  const Receiver sideways{{0.02, 0.4, 0.5}, {1, 0, 0}}; // light grazes the pane
  const double direct =
      static_cast<double>(DirectSky(room, pane, rays, sky).irradiance(sideways.position, sideways.normal).g);
  const double open =
      static_cast<double>(DirectSky(room, kOpenFace, rays, sky).irradiance(sideways.position, sideways.normal).g);
  EXPECT_LT(direct, 0.9 * open);
  EXPECT_GT(direct, 0.8 * open);
  const auto e =
      trace_irradiance(*scene, std::span(&sideways, 1), {.samples = 32768, .indirect = false, .direct = true});
  ASSERT_TRUE(e);
  EXPECT_NEAR(static_cast<double>((*e)[0].value.g) / direct, 1.0, 3e-3);
}

// Furnace: with reflectance 1 everywhere and radiance L outside, L is the radiance everywhere, whatever the shape.
TEST(Oracle, room_of_reflectance_one_under_a_uniform_sky_is_as_bright_as_the_sky) {
  const auto scene = TraceScene::make(open_cube(1.0f), kOpenFace, SkyLight(uniform_sky(1.0f)));
  ASSERT_TRUE(scene);
  const Receiver points[] = {{{0.5, 0.5, 0.5}, {0, 0, 1}}, {{0.2, 0.9, 0.1}, {0, 1, 0}}};
  const auto e = trace_irradiance(*scene, points, {.samples = 16384, .direct = true});
  ASSERT_TRUE(e);
  for (const IrradianceEstimate& estimate : *e) {
    EXPECT_LT(estimate.standard_error.g, 0.01 * kPi);
    EXPECT_NEAR(relative_spread(estimate, kPi), 0.0, 4.5);
  }
}

TEST(Oracle, coefficients_of_a_uniform_surround_are_its_mean_alone) {
  const auto scene = TraceScene::make(open_cube(1.0f), kOpenFace, SkyLight(uniform_sky(1.0f)));
  ASSERT_TRUE(scene);
  const Receiver middle{{0.5, 0.5, 0.5}, {0, 0, 1}};
  const auto e = trace_coefficients(*scene, std::span(&middle, 1), {.samples = 16384, .direct = true});
  ASSERT_TRUE(e);
  for (std::size_t k = 0; k < 9; ++k)
    EXPECT_NEAR((*e)[0].value[k].g, k == 0 ? std::sqrt(4.0 * kPi) : 0.0,
                4.5 * static_cast<double>((*e)[0].standard_error[k].g))
        << k;
}

// A large sun as an analytic disc (sampled over its disc and by sunlit surfaces) and the same sun as bright texels of
// an image (sampled as bright spots and through the opening): different estimators, one answer.
TEST(Oracle, analytic_sun_and_sun_in_an_image_light_a_room_alike) {
  SkyModel model = uniform_sky(0.0f);
  model.sun = SunDisc{glm::normalize(glm::dvec3(0.3, -1.0, 0.6)), 0.08, Rgb(10.0f)};
  RgbImage image(1024, 512);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      int inside = 0; // of 8 x 8 points of equal area
      for (int k = 0; k < 64; ++k) {
        const double azimuth = (0.5 - (x + (k % 8 + 0.5) / 8.0) / image.width) * 2.0 * kPi;
        const double z = std::cos(kPi * (y + (k / 8 + 0.5) / 8.0) / image.height), r = std::sqrt(1.0 - z * z);
        inside += model.sun->contains({r * std::cos(azimuth), r * std::sin(azimuth), z}) ? 1 : 0;
      }
      image.at(x, y) = model.sun->radiance() * (static_cast<float>(inside) / 64.0f);
    }
  auto sky = SkyImage::make(std::move(image), EquirectProjection{});
  ASSERT_TRUE(sky);
  const auto a = TraceScene::make(open_cube(0.7f), kOpenFace, SkyLight(model));
  const auto b =
      TraceScene::make(open_cube(0.7f), kOpenFace, SkyLight(std::make_shared<const SkyImage>(*std::move(sky))));
  ASSERT_TRUE(a && b);
  const Receiver points[] = {{{0.2, 0.2, 0.3}, {0, 0, 1}}, {{0.6, 0.5, 0.7}, {0, -1, 0}}, {{0.5, 0.9, 0.2}, {1, 0, 0}}};
  const auto ea = trace_irradiance(*a, points, {.samples = 8192}),
             eb = trace_irradiance(*b, points, {.samples = 8192, .seed = 1});
  ASSERT_TRUE(ea && eb);
  for (std::size_t i = 0; i < 3; ++i) {
    const double va = static_cast<double>((*ea)[i].value.g), vb = static_cast<double>((*eb)[i].value.g);
    const double se =
        std::hypot(static_cast<double>((*ea)[i].standard_error.g), static_cast<double>((*eb)[i].standard_error.g));
    EXPECT_LT(se, 0.02 * va);
    EXPECT_NEAR(va, vb, 4.0 * se + 0.002 * va) << "the discretised disc is good to 0.2 %";
  }
}

TEST(Oracle, same_seed_gives_the_same_bits_for_any_number_of_threads) {
  const auto scene = TraceScene::make(open_cube(0.8f), kOpenFace, SkyLight(uniform_sky(1.0f)));
  ASSERT_TRUE(scene);
  const Receiver points[] = {{{0.5, 0.5, 0.5}, {0, 0, 1}}, {{0.5, 0.5, 0.5}, {1, 0, 0}}, {{0.2, 0.9, 0.1}, {0, 1, 0}}};
  std::vector<IrradianceEstimate> runs[3];
  for (const int threads : {1, 2, 4}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
    auto e = trace_irradiance(*scene, points, {.samples = 256, .seed = 42, .direct = true});
    ASSERT_TRUE(e);
    runs[threads / 2] = *std::move(e);
  }
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(runs[0][i].value, runs[1][i].value);
    EXPECT_EQ(runs[0][i].standard_error, runs[2][i].standard_error);
  }
}

// Deviations of repeated runs from their common mean, in units of their own standard errors: with 15 degrees of freedom
// their root mean square is sqrt(15 / 13) = 1.07.
TEST(Oracle, standard_errors_are_honest) {
  const auto scene = test::truth_scene("S1", "E2");
  ASSERT_TRUE(scene);
  std::vector<Receiver> points;
  for (const auto& row : test::truth_rows("S1", "E2", "indirect"))
    if (points.empty() || points.back().position != row.receiver.position)
      points.push_back(row.receiver);
  constexpr int kRuns = 12;
  std::vector<std::vector<IrradianceEstimate>> runs;
  for (std::uint32_t seed = 0; seed < kRuns; ++seed)
    runs.push_back(*trace_irradiance(*scene, points, {.samples = 256, .seed = seed}));
  double square = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    double mean = 0.0;
    for (const auto& run : runs)
      mean += static_cast<double>(run[i].value.g) / kRuns;
    for (const auto& run : runs)
      square += std::pow(relative_spread(run[i], mean), 2);
  }
  const double z = std::sqrt(square / (static_cast<double>(points.size()) * (kRuns - 1)));
  EXPECT_GT(z, 0.9);
  EXPECT_LT(z, 1.3);
}

TEST(Oracle, too_few_samples_are_refused) {
  const auto scene = TraceScene::make(open_cube(0.8f), kOpenFace, SkyLight(uniform_sky(1.0f)));
  const Receiver point{};
  EXPECT_FALSE(trace_irradiance(*scene, std::span(&point, 1), {.samples = 15}));
}

} // namespace
} // namespace daylit
