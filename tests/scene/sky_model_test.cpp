#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "scene/sky/sky_model.h"

namespace daylit {
namespace {

constexpr double kPi = std::numbers::pi;

glm::dvec3 direction(double zenith, double azimuth) {
  return {std::sin(zenith) * std::cos(azimuth), std::sin(zenith) * std::sin(azimuth), std::cos(zenith)};
}

/// Midpoint rule over a rectangle in the plane z = height, seen from the floor: E per horizontal irradiance, percent.
double sky_component_percent(const AnalyticSky& sky, double cx, double cy, double side, double height) {
  constexpr int n = 400;
  double sum = 0.0;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const glm::dvec3 p(cx + side * ((i + 0.5) / n - 0.5), cy + side * ((j + 0.5) / n - 0.5), height);
      const double r2 = glm::dot(p, p), r = std::sqrt(r2);
      sum += static_cast<double>(sky.sky_radiance(p / r).r) * (p.z / r) * (p.z / r) / r2;
    }
  const double area = side * side / (n * n);
  return 100.0 * sum * area / static_cast<double>(sky.diffuse_horizontal_irradiance().r);
}

SkyModel clear_model(double sun_zenith) {
  SkyModel model;
  model.kind = SkyModel::Kind::clear;
  model.sun = SunDisc{direction(sun_zenith, 0.0), 0.00465, Rgb(100.0f)};
  return model;
}

TEST(SkyModel, uniform_sky_gives_pi_times_its_radiance) {
  SkyModel model;
  model.kind = SkyModel::Kind::uniform;
  model.zenith_radiance = Rgb(1.0f, 2.0f, 3.0f);
  EXPECT_NEAR(model.horizontal_irradiance().g, 2.0 * kPi, 1e-5);
}

TEST(SkyModel, overcast_sky_gives_seven_ninths_of_pi_and_three_to_one_from_zenith_to_horizon) {
  SkyModel model;
  model.zenith_radiance = Rgb(3.0f);
  EXPECT_NEAR(model.horizontal_irradiance().r, 7.0 * kPi / 3.0, 1e-5);
  EXPECT_NEAR(model.sky_radiance({0, 0, 1}).r, 3.0, 1e-6);
  EXPECT_NEAR(model.sky_radiance({1, 0, 0}).r, 1.0, 1e-6);
}

// Reference: the sky component under a roof opening of a 4 x 4 x 3 m room (CIE 171 case 5.9), in percent of the
// unobstructed diffuse horizontal irradiance, computed independently by Gauss rules.
TEST(SkyModel, clear_sky_through_a_roof_opening_matches_the_reference_values) {
  const AnalyticSky sky(clear_model(40.0 * kPi / 180.0));
  EXPECT_NEAR(sky_component_percent(sky, 0, 0, 1.0, 3.0), 2.5494, 2e-4);
  EXPECT_NEAR(sky_component_percent(sky, 0, 0, 4.0, 3.0), 31.239, 2e-3);
}

TEST(SkyModel, clear_horizontal_irradiance_agrees_with_a_brute_force_sum) {
  const AnalyticSky sky(clear_model(50.0 * kPi / 180.0));
  double sum = 0.0;
  constexpr int nz = 900, na = 1800; // midpoint rule, error about (pi/2/nz)^2
  for (int i = 0; i < nz; ++i)
    for (int k = 0; k < na; ++k) {
      const double z = (i + 0.5) * 0.5 * kPi / nz;
      sum +=
          static_cast<double>(sky.sky_radiance(direction(z, (k + 0.5) * 2.0 * kPi / na)).r) * std::cos(z) * std::sin(z);
    }
  sum *= 0.5 * kPi / nz * 2.0 * kPi / na;
  EXPECT_NEAR(static_cast<double>(sky.diffuse_horizontal_irradiance().r) / sum, 1.0, 1e-5);
}

TEST(SkyModel, clear_sky_has_the_zenith_radiance_at_the_zenith) {
  const AnalyticSky sky(clear_model(1.0));
  EXPECT_NEAR(sky.sky_radiance({0, 0, 1}).r, 1.0, 1e-6);
}

TEST(SkyModel, sun_disc_integrates_to_its_normal_irradiance) {
  for (const double radius : {0.00465, 0.1}) {
    const SunDisc sun{{0, 0, 1}, radius, Rgb(800.0f)};
    double integral = 0.0; // of radiance x cos over the disc, rings of equal width
    constexpr int n = 1000;
    for (int i = 0; i < n; ++i) {
      const double t = radius * (i + 0.5) / n;
      integral += static_cast<double>(sun.radiance().r) * std::cos(t) * 2.0 * kPi * std::sin(t) * radius / n;
    }
    EXPECT_NEAR(integral, 800.0, 800.0 * 2e-6);
    EXPECT_NEAR(sun.solid_angle_sr(), 2.0 * kPi * (1.0 - std::cos(radius)), 1e-9);
  }
}

TEST(SkyModel, sun_disc_contains_what_lies_within_its_radius) {
  const SunDisc sun{direction(0.7, 0.3), 0.00465, Rgb(1.0f)};
  EXPECT_TRUE(sun.contains(direction(0.7 + 0.00464, 0.3)));
  EXPECT_FALSE(sun.contains(direction(0.7 + 0.00466, 0.3)));
}

TEST(SkyModel, ground_reflects_sky_and_sun) {
  SkyModel model = clear_model(0.8);
  model.ground_albedo = 0.3f;
  const AnalyticSky sky(model);
  const double horizontal = static_cast<double>(sky.diffuse_horizontal_irradiance().r) + 100.0 * std::cos(0.8);
  EXPECT_NEAR(sky.horizontal_irradiance().r, horizontal, 1e-4 * horizontal);
  EXPECT_NEAR(sky.radiance({0, 0, -1}).r, 0.3 * horizontal / kPi, 1e-4 * horizontal);
  model.ground_albedo = -1.0f;
  model.ground_radiance = Rgb(0.25f);
  EXPECT_FLOAT_EQ(model.radiance({0, 0.6, -0.8}).r, 0.25f);
}

} // namespace
} // namespace daylit
