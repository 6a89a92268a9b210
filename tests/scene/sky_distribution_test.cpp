#include "scene/sky/sky_distribution.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "scene/sky/perez_sky.h"

namespace daylit {
namespace {

constexpr double kPi = std::numbers::pi, kDegrees = 180.0 / kPi;

glm::dvec3 direction(double zenith, double azimuth) {
  return {std::sin(zenith) * std::cos(azimuth), std::sin(zenith) * std::sin(azimuth), std::cos(zenith)};
}

/// The obvious sum over the hemisphere: midpoint rule in zenith angle and azimuth.
double brute_force_integral(const SkyDistribution& sky, double sun_zenith) {
  constexpr int nz = 400, na = 360;
  const glm::dvec3 sun = direction(sun_zenith, 0.0);
  double sum = 0.0;
  for (int i = 0; i < nz; ++i) {
    const double z = (i + 0.5) * 0.5 * kPi / nz;
    for (int k = 0; k < na; ++k)
      sum += sky.relative(direction(z, (k + 0.5) * 2.0 * kPi / na), sun) * std::cos(z) * std::sin(z);
  }
  return sum * 0.5 * kPi / nz * 2.0 * kPi / na;
}

/// E_3(x), x > 0 (Abramowitz & Stegun 5.1.14).
double exponential_integral_3(double x) {
  const double e1 = -std::expint(-x), e2 = std::exp(-x) - x * e1;
  return 0.5 * (std::exp(-x) - x * e2);
}

// Integral of (1 + a exp(b / cos Z)) cos Z over the hemisphere: 2 pi (1/2 + a E_3(-b)).
TEST(SkyDistribution, types_without_a_sun_have_the_closed_form_of_the_exponential_integral) {
  for (const int type : {1, 3, 5}) {
    const SkyDistribution sky = *cie_sky(type);
    const double exact = 2.0 * kPi * (0.5 + sky.a * exponential_integral_3(-sky.b));
    EXPECT_NEAR(sky.horizontal_integral(0.3) / exact, 1.0, 1e-7) << type;
  }
  EXPECT_NEAR(cie_sky(5)->horizontal_integral(0.7), kPi, 1e-12);
}

// With a = 0 and the sun in the zenith, chi = Z: 2 pi times the integral of (base + c exp(d Z) + e cos^2 Z) cos Z sin
// Z.
TEST(SkyDistribution, zenith_sun_has_an_elementary_integral) {
  for (const int type : {6, 7, 8}) {
    const SkyDistribution s = *cie_sky(type);
    // Integral of exp(d Z) sin 2Z / 2 over 0..pi/2 is (1 + exp(d pi/2)) / (d^2 + 4).
    const double exact =
        2.0 * kPi * (0.5 * s.base + s.c * (1.0 + std::exp(s.d * kPi / 2.0)) / (s.d * s.d + 4.0) + 0.25 * s.e);
    EXPECT_NEAR(s.horizontal_integral(1.0) / exact, 1.0, 1e-7) << type;
  }
}

TEST(SkyDistribution, every_type_integrates_as_the_obvious_sum_does) {
  for (int type = 1; type <= 15; ++type)
    for (const double sun_zenith : {0.0, 0.6, 1.3, kPi / 2}) {
      const SkyDistribution sky = *cie_sky(type);
      EXPECT_NEAR(sky.horizontal_integral(std::cos(sun_zenith)) / brute_force_integral(sky, sun_zenith), 1.0, 1e-4)
          << type << " " << sun_zenith;
    }
}

// CIE S 011: the indicatrix is 1 a right angle from the sun (but for e cos^2), the gradation 1 at the horizon.
TEST(SkyDistribution, standard_types_are_one_at_the_horizon_a_right_angle_from_the_sun) {
  for (int type = 1; type <= 15; ++type)
    EXPECT_NEAR(cie_sky(type)->relative({1, 0, 0}, {0, 1, 0}), 1.0, 1e-12) << type;
}

// phi(0) of each group of gradations, from the standard's formula: 1 + 4 exp(-0.7), ...
TEST(SkyDistribution, zenith_to_horizon_ratios_are_those_of_the_standard) {
  const double expected[] = {1 + 4 * std::exp(-0.7), 1 + 1.1 * std::exp(-0.8), 1.0,
                             1 - std::exp(-0.55),    1 - std::exp(-0.32),      1 - std::exp(-0.15)};
  const int type[] = {1, 3, 5, 9, 12, 15};
  for (int k = 0; k < 6; ++k)
    EXPECT_NEAR(cie_sky(type[k])->gradation(1.0), expected[k], 1e-15);
  EXPECT_FALSE(cie_sky(0));
  EXPECT_FALSE(cie_sky(16));
}

TEST(SkyDistribution, is_nowhere_negative_and_finite_at_the_horizon) {
  const SkyDistribution odd{-2.0, 0.3, 5.0, -1.0, 0.1, -2.0};
  for (int i = 0; i <= 90; ++i)
    for (int k = 0; k < 8; ++k) {
      const double l = odd.relative(direction(i / kDegrees, k), direction(0.5, 0.0));
      EXPECT_TRUE(std::isfinite(l) && l >= 0.0);
    }
}

struct Hour {
  int day; ///< of the year
  double direct, diffuse;
  glm::dvec3 sun;
  double sun_radiance; ///< of a disc 0.533 degrees across, luminance / 179
  double to_zenith[6]; ///< radiance over zenith radiance
};

// Written by Radiance's gendaymtx (source of December 2021: -m 1 -s -O0 -of, and -D for the suns) for hours of a tape
// of New York without dew points: Perez model, eight bins. Altitude and azimuth (from north through east) of the
// patches.
constexpr double kPatch[6][2] = {{6, 0}, {18, 108}, {30, 135}, {42, 225}, {54, 320}, {78, 60}};
const Hour kHours[] = {
    {80,
     675,
     95,
     {0.80197, -0.39548, 0.447704},
     5261000,
     {2.919449, 14.550795, 8.082624, 1.136846, 0.929628, 1.143666}},
    {172, 0, 291, {0.72115, -0.069038, 0.689331}, 0, {0.522438, 0.966997, 1.001064, 0.735073, 0.791329, 1.081200}},
    {172,
     163,
     282,
     {-0.567069, -0.169676, 0.806004},
     1303000,
     {0.763211, 0.702650, 0.648532, 2.246668, 1.084718, 0.715396}},
    {172,
     409,
     289,
     {-0.734394, -0.057764, 0.676261},
     3215000,
     {0.910327, 0.830172, 0.751312, 2.195168, 1.540472, 0.788528}},
    {263,
     481,
     133,
     {-0.820414, -0.37078, 0.43525},
     3550000,
     {1.977274, 1.554333, 1.265160, 4.326842, 1.237565, 0.889100}},
    {356,
     36,
     61,
     {0.712071, -0.679126, 0.178165},
     210900,
     {3.440154, 10.212436, 9.585416, 1.837494, 1.297597, 1.080678}},
    {356,
     198,
     130,
     {0.538084, -0.786627, 0.302794},
     1324000,
     {1.630421, 3.870586, 6.871057, 1.354127, 0.971642, 1.023767}}};

/// With the Earth's distance of Spencer (1971), which gendaymtx uses.
PerezWeather weather_of(const Hour& hour) {
  const double g = (hour.day - 1) * 2.0 * kPi / 365.0;
  const double square = 1.00011 + 0.034221 * std::cos(g) + 0.00128 * std::sin(g) + 0.000719 * std::cos(2.0 * g) +
                        0.000077 * std::sin(2.0 * g);
  return {.direct_normal_W_m2 = hour.direct,
          .diffuse_horizontal_W_m2 = hour.diffuse,
          .sun_altitude = std::asin(hour.sun.z),
          .sun_distance_au = 1.0 / std::sqrt(square)};
}

TEST(PerezSky, has_the_shape_and_the_sun_of_gendaymtx) {
  for (const Hour& hour : kHours) {
    const auto sky = perez_sky(weather_of(hour));
    ASSERT_TRUE(sky) << sky.error().message();
    const double zenith = sky->distribution.relative({0, 0, 1}, hour.sun);
    for (int k = 0; k < 6; ++k) {
      const double azimuth = kPi / 2 - kPatch[k][1] / kDegrees;
      const double l = sky->distribution.relative(direction(kPi / 2 - kPatch[k][0] / kDegrees, azimuth), hour.sun);
      EXPECT_NEAR(l / zenith / hour.to_zenith[k], 1.0, 5e-4) << hour.direct << " " << k;
    }
    const double radius = 0.5 * 0.533 / kDegrees;
    const double radiance = sky->direct_normal_lx / 179.0 / (kPi * radius * radius);
    EXPECT_NEAR(radiance, hour.sun_radiance, 5e-4 * hour.sun_radiance);
  }
}

TEST(PerezSky, sky_integrates_to_its_diffuse_irradiance) {
  for (const Hour& hour : kHours) {
    const auto sky = perez_sky(weather_of(hour));
    ASSERT_TRUE(sky);
    EXPECT_NEAR(sky->distribution.horizontal_integral(hour.sun.z) /
                    brute_force_integral(sky->distribution, std::acos(hour.sun.z)),
                1.0, 2e-4);
  }
}

// [1990] by hand: Z = 60 degrees, 600 and 100 W/m2, dew point 11 C.
TEST(PerezSky, clearness_brightness_and_efficacies_follow_the_paper) {
  const auto sky = perez_sky({.direct_normal_W_m2 = 600, .diffuse_horizontal_W_m2 = 100, .sun_altitude = kPi / 6});
  ASSERT_TRUE(sky);
  const double z3 = 1.041 * std::pow(kPi / 3, 3);
  EXPECT_NEAR(sky->clearness, (7.0 + z3) / (1.0 + z3), 1e-12); // 3.735: the sixth bin
  const double mass = 1.0 / (0.5 + 0.15 * std::pow(33.885, -1.253));
  EXPECT_NEAR(sky->brightness, 100 * mass / 1367, 1e-12);
  const double water = std::exp(0.07 * 11 - 0.075);
  EXPECT_NEAR(sky->diffuse_efficacy_lm_W, 106.42 + 3.83 * water - 36.15 * 0.5 - 28.83 * std::log(sky->brightness),
              1e-9);
  EXPECT_NEAR(sky->direct_efficacy_lm_W,
              107.19 - 1.25 * water - 1.51 * std::exp(5.73 * kPi / 3 - 5) - 26.73 * sky->brightness, 1e-9);
  EXPECT_TRUE(sky->notes.empty());
}

TEST(PerezSky, illuminances_are_turned_back_into_their_irradiances) {
  for (const Hour& hour : kHours) {
    const PerezWeather weather = weather_of(hour);
    const auto sky = perez_sky(weather);
    const auto back = weather_from_illuminance(sky->direct_normal_lx, sky->diffuse_horizontal_lx, weather);
    ASSERT_TRUE(back) << hour.direct << ": " << back.error().message();
    const auto again = perez_sky(*back);
    EXPECT_NEAR(again->direct_normal_lx, sky->direct_normal_lx, 1e-8 * sky->direct_normal_lx);
    EXPECT_NEAR(again->diffuse_horizontal_lx, sky->diffuse_horizontal_lx, 1e-8 * sky->diffuse_horizontal_lx);
  }
}

TEST(PerezSky, refuses_what_is_no_daylight_and_says_which_limits_were_overstepped) {
  EXPECT_FALSE(perez_sky({.direct_normal_W_m2 = 100}));
  EXPECT_FALSE(perez_sky({.direct_normal_W_m2 = -1, .diffuse_horizontal_W_m2 = 10}));
  EXPECT_FALSE(perez_sky({.direct_normal_W_m2 = 9999, .diffuse_horizontal_W_m2 = 10}));
  EXPECT_FALSE(perez_sky({.direct_normal_W_m2 = std::nan(""), .diffuse_horizontal_W_m2 = 10}));
  EXPECT_FALSE(perez_sky({.diffuse_horizontal_W_m2 = 10, .dew_point_C = 1000}));
  const auto clear = perez_sky({.direct_normal_W_m2 = 1000, .diffuse_horizontal_W_m2 = 10, .sun_altitude = 1.0});
  ASSERT_TRUE(clear);
  EXPECT_EQ(clear->clearness, 12.0);
  EXPECT_FALSE(clear->notes.empty());
}

} // namespace
} // namespace daylit
