// Light of a sun patch on the floor at an object above it: against the solid angle of a rectangle, and against
// FirstReflection::correction(), which looks at the patch from every point alone.

#include "runtime/indirect/near_sunlight.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "sh/sh9.h"
#include "sunny_floor.h"

namespace daylit {
namespace {

using test::kLit;
using test::kPlaces;
using test::kTowardsSun;
using test::kX0;
using test::kX1;
using test::kY0;
using test::kY1;
using test::sum;
using test::SunnyFloor;

bool same_bits(const std::vector<Sh9Rgb>& a, const std::vector<Sh9Rgb>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(Sh9Rgb)) == 0;
}
float brightest(const std::vector<Sh9Rgb>& light) {
  float most = 0.0f;
  for (const Sh9Rgb& l : light)
    most = std::max(most, l[0].g);
  return most;
}

/// Solid angle of the patch; of each a x b rectangle from a point d above one of its corners
/// atan(ab / (d sqrt(a^2 + b^2 + d^2))), less where the corner lies beyond.
double patch_solid_angle(const glm::dvec3& x) {
  double omega = 0.0;
  for (const double a : {x.x - kX0, kX1 - x.x})
    for (const double b : {x.y - kY0, kY1 - x.y})
      omega += std::atan(a * b / (x.z * std::sqrt(a * a + b * b + x.z * x.z)));
  return omega;
}

TEST(NearSunlight, with_the_volumes_light_is_the_solid_angle_of_the_patch) {
  for (const glm::dvec3& place : kPlaces) {
    SunnyFloor floor({place});
    const std::vector<Sh9Rgb> light = sum(floor.base(), floor.correction());
    const double tolerance = 0.02 * static_cast<double>(brightest(light));
    for (std::size_t v = 0; v < light.size(); ++v)
      for (int c = 0; c < 3; ++c) // L_00 = L omega Y_00
        EXPECT_NEAR(static_cast<double>(light[v][0][c]),
                    static_cast<double>(SunnyFloor::patch_radiance()[c]) * patch_solid_angle(floor.at()[v]) *
                        0.28209479,
                    tolerance)
            << place.y << ", vertex " << v;
  }
}

/// L_lm = integral of L V Y_lm(d) z / |y - x|^3 over the patch, by squares of 5 mm; V: not in the sphere's shadow.
Sh9Rgb patch_light(const glm::dvec3& x, const std::optional<glm::dvec3>& sphere) {
  constexpr double kStep = 0.005;
  Sh9Rgb sum{};
  for (double a = kX0 + 0.5 * kStep; a < kX1; a += kStep)
    for (double b = kY0 + 0.5 * kStep; b < kY1; b += kStep) {
      const glm::dvec3 y(a, b, 0.0);
      if (sphere && glm::length(glm::cross(*sphere - y, kTowardsSun)) < static_cast<double>(SunnyFloor::kRadius))
        continue;
      const double distance = glm::distance(x, y);
      const auto omega = static_cast<float>(kStep * kStep * x.z / (distance * distance * distance));
      const auto basis = sh::evaluate9(glm::vec3((y - x) / distance));
      for (std::size_t i = 0; i < 9; ++i)
        sum[i] += omega * basis[i] * SunnyFloor::patch_radiance();
    }
  return sum;
}

void expect_the_integral_over_the_patch(bool shadow) {
  for (const glm::dvec3& place : kPlaces) {
    SunnyFloor floor({place});
    const std::vector<Sh9Rgb> light = sum(floor.base(), floor.correction(1, shadow));
    const float most = brightest(light);
    for (std::size_t v = 0; v < light.size(); v += 23) {
      const Sh9Rgb exact = patch_light(floor.at()[v], shadow ? std::optional(place) : std::nullopt);
      for (std::size_t i = 0; i < 9; ++i)
        EXPECT_NEAR(light[v][i].g, exact[i].g, 0.035f * most) << place.y << ", vertex " << v << ", " << i;
    }
  }
}
TEST(NearSunlight, with_the_volumes_light_is_the_integral_over_the_patch) { expect_the_integral_over_the_patch(false); }
TEST(NearSunlight, with_the_volumes_light_is_the_integral_over_the_patch_without_the_objects_shadow) {
  expect_the_integral_over_the_patch(true);
}

TEST(NearSunlight, of_a_floor_that_is_lit_all_over_is_the_correction_of_each_point_alone) {
  for (const glm::dvec3& place : kPlaces) {
    SunnyFloor floor({place}, kLit);
    const std::vector<Sh9Rgb> fast = floor.correction();
    const float most = brightest(sum(floor.base(), fast));
    for (std::size_t v = 0; v < fast.size(); v += 23) {
      const Sh9Rgb slow = floor.correction_at(v);
      for (std::size_t i = 0; i < 9; ++i)
        EXPECT_NEAR(fast[v][i].g, slow[i].g, 0.02f * most) << place.y << ", vertex " << v << ", " << i;
    }
  }
}

TEST(NearSunlight, where_an_object_touches_the_patch_comes_from_all_of_the_half_space_below) {
  SunnyFloor floor({{2.0, 2.5, 0.1}});
  const std::vector<Sh9Rgb> light = sum(floor.base(), floor.correction());
  int touching = 0;
  for (std::size_t v = 0; v < light.size(); ++v) {
    if (floor.at()[v].z > 0.001)
      continue;
    ++touching;
    const auto radiance = static_cast<double>(SunnyFloor::patch_radiance().g);
    const double along_z = -std::sqrt(3.0 / (4.0 * test::kPi)) * test::kPi * radiance; // L_10
    EXPECT_NEAR(static_cast<double>(light[v][2].g), along_z, -0.08 * along_z);
    for (const std::size_t level : {1u, 3u})
      EXPECT_NEAR(static_cast<double>(light[v][level].g), 0.0, -0.08 * along_z);
  }
  EXPECT_GT(touching, 0);
}

TEST(NearSunlight, of_a_strip_6_cm_wide_half_a_metre_away_is_its_solid_angle) {
  SunnyFloor floor({{2.0, 4.5, 0.3}}, {1.0f, 3.0f, 4.5f, 5.0f});
  floor.sun->direction = glm::normalize(glm::dvec3(0.0, 0.05, 1.0)); // lights 4.895 < y < 4.955
  const std::vector<Sh9Rgb> light = sum(floor.base(), floor.correction());
  double error2 = 0, power2 = 0;
  for (std::size_t v = 0; v < light.size(); ++v) {
    const glm::dvec3& x = floor.at()[v];
    double omega = 0.0;
    for (const double a : {x.x - kX0, kX1 - x.x})
      for (const double b : {4.955 - x.y, x.y - 4.895})
        omega += std::atan(a * b / (x.z * std::sqrt(a * a + b * b + x.z * x.z)));
    const double cosine = floor.sun->direction.z / kTowardsSun.z, // patch_radiance() is that of kTowardsSun
        exact = static_cast<double>(SunnyFloor::patch_radiance().g) * cosine * omega * 0.28209479;
    error2 += std::pow(static_cast<double>(light[v][0].g) - exact, 2);
    power2 += exact * exact;
  }
  EXPECT_LT(std::sqrt(error2 / power2), 0.02); // 0.4 %
}

TEST(NearSunlight, is_proportional_to_the_sun_and_zero_without_one) {
  SunnyFloor floor;
  const std::vector<Sh9Rgb> light = floor.correction();
  floor.sun->normal_irradiance *= 4.0f;
  const std::vector<Sh9Rgb> more = floor.correction();
  floor.sun.reset();
  const std::vector<Sh9Rgb> none = floor.correction();
  ASSERT_EQ(none.size(), light.size());
  EXPECT_GT(std::abs(light[0][0].g), 0.01f);
  for (std::size_t v = 0; v < light.size(); ++v)
    for (std::size_t i = 0; i < 9; ++i) {
      EXPECT_EQ(more[v][i], 4.0f * light[v][i]);
      EXPECT_EQ(none[v][i], Rgb(0.0f));
    }
}

TEST(NearSunlight, of_a_volume_that_does_not_name_its_elements_is_zero) {
  SunnyFloor floor;
  EXPECT_TRUE(floor.near.is_known());
  floor.volume.elements = {};
  NearSunlight unknown(floor.volume, floor.room.rays, floor.windows);
  EXPECT_FALSE(unknown.is_known());
  const std::vector<Sh9Rgb> light = unknown.correction(floor.objects, floor.probes, 1, floor.sun, nullptr);
  ASSERT_EQ(light.size(), floor.probes.size());
  EXPECT_TRUE(same_bits(light, std::vector<Sh9Rgb>(light.size())));
}

TEST(NearSunlight, is_zero_at_vertices_without_a_light_field) {
  SunnyFloor floor;
  const std::vector<Sh9Rgb> light = floor.correction();
  floor.probes[5].count = 0;
  const std::vector<Sh9Rgb> without = floor.correction(2);
  EXPECT_NE(light[5][0], Rgb(0.0f));
  EXPECT_EQ(without[5], Sh9Rgb{});
  EXPECT_NE(without[6][0], Rgb(0.0f));
}

TEST(NearSunlight, objects_in_their_shadow_receive_less_and_nowhere_less_than_nothing) {
  for (const glm::dvec3& place : {glm::dvec3(2.0, 2.5, 0.1), kPlaces[0], kPlaces[1]}) {
    SunnyFloor floor({place});
    const std::vector<Sh9Rgb> base = floor.base(), open = sum(base, floor.correction(1, false)),
                              shadowed = sum(base, floor.correction(2, true));
    const float all = brightest(open);
    float least = 1.0f;
    for (std::size_t v = 0; v < open.size(); ++v) {
      for (int c = 0; c < 3; ++c)
        EXPECT_GT(shadowed[v][0][c], -1e-4f * all) << place.z << ", vertex " << v;
      EXPECT_LT(shadowed[v][0].g, open[v][0].g + 0.01f * all) << place.z << ", vertex " << v;
      // The middle of the shadow lies 1 / 0.6 of the height behind.
      if (floor.at()[v].z < place.z && floor.at()[v].y < place.y)
        least = std::min(least, shadowed[v][0].g / open[v][0].g);
    }
    EXPECT_LT(least, 0.6f) << place.z;
  }
}

TEST(NearSunlight, each_of_two_objects_is_corrected_as_if_it_stood_alone) {
  SunnyFloor both({kPlaces[0], kPlaces[1]});
  const std::vector<Sh9Rgb> light = both.correction();
  const float most = brightest(sum(both.base(), light));
  std::size_t compared = 0;
  for (const glm::dvec3& place : {kPlaces[0], kPlaces[1]}) {
    SunnyFloor one({place});
    const std::vector<Sh9Rgb> alone = one.correction();
    for (std::size_t v = 0; v < alone.size(); ++v)
      for (std::size_t w = 0; w < light.size(); ++w)
        if (one.at()[v] == both.at()[w]) {
          EXPECT_NEAR(alone[v][0].g, light[w][0].g, 0.02f * most);
          ++compared;
          break;
        }
  }
  EXPECT_GT(compared, both.at().size() / 3);
}

TEST(NearSunlight, is_found_anew_for_another_placement_or_sun_and_else_has_the_same_bits) {
  SunnyFloor floor;
  const std::vector<Sh9Rgb> first = floor.correction(1, true);
  EXPECT_TRUE(same_bits(floor.correction(1, true), first));
  floor.stand_at({kPlaces[1]});
  const std::vector<Sh9Rgb> moved = floor.correction(2, true);
  EXPECT_FALSE(same_bits(moved, first));
  SunnyFloor fresh({kPlaces[1]});
  EXPECT_TRUE(same_bits(moved, fresh.correction(1, true)));
  floor.sun->direction = fresh.sun->direction = glm::normalize(glm::dvec3(0.2, 1.0, 0.6));
  const std::vector<Sh9Rgb> turned = floor.correction(2, true);
  EXPECT_FALSE(same_bits(turned, moved));
  EXPECT_TRUE(same_bits(turned, fresh.correction(2, true)));
}

} // namespace
} // namespace daylit
