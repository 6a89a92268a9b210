#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include "runtime/maps/environment_map.h"
#include "runtime/maps/radiance_map.h"

namespace daylit {
namespace {

glm::dvec3 random_direction(std::mt19937_64& engine) {
  std::normal_distribution<double> normal;
  return glm::normalize(glm::dvec3(normal(engine), normal(engine), normal(engine)));
}

TEST(Octahedral, point_and_direction_are_inverse_everywhere) {
  std::mt19937_64 engine(1);
  for (int k = 0; k < 10000; ++k) {
    const glm::dvec3 w = random_direction(engine);
    EXPECT_LT(glm::length(octahedral_direction(octahedral_point(w)) - w), 1e-14);
  }
  for (const glm::dvec3& w : {glm::dvec3(0, 0, 1), glm::dvec3(0, 0, -1), glm::dvec3(1, 0, 0), glm::dvec3(0, -1, 0),
                              glm::dvec3(-1, 0, 0), glm::normalize(glm::dvec3(1e-9, -1e-9, 1))})
    EXPECT_LT(glm::length(octahedral_direction(octahedral_point(w)) - w), 1e-14);
}

TEST(Octahedral, every_texel_has_the_same_solid_angle) {
  // Solid angle of the four corners' spherical quadrilateral by two triangles (van Oosterom & Strackee 1983); a texel's
  // edges are not great circles, so a fine map is taken: the error falls as the square of its texels.
  const int side = 256;
  const auto triangle = [](const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
    const double volume = std::abs(glm::dot(a, glm::cross(b, c)));
    return 2.0 * std::atan2(volume, 1.0 + glm::dot(a, b) + glm::dot(b, c) + glm::dot(c, a));
  };
  const double expected = RadianceMap(side).solid_angle_sr();
  double sum = 0.0;
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) {
      const auto corner = [&](int a, int b) {
        return octahedral_direction({2.0 * (x + a) / side - 1.0, 2.0 * (y + b) / side - 1.0});
      };
      // split along the diagonal that a fold may follow
      const bool falling = (x < side / 2) == (y < side / 2);
      const double area =
          falling
              ? triangle(corner(0, 0), corner(1, 0), corner(0, 1)) + triangle(corner(1, 1), corner(1, 0), corner(0, 1))
              : triangle(corner(0, 0), corner(1, 0), corner(1, 1)) + triangle(corner(0, 0), corner(0, 1), corner(1, 1));
      EXPECT_NEAR(area / expected, 1.0, 0.12); // the four texels about a pole are quarters of a round cap
      sum += area;
    }
  EXPECT_NEAR(sum, 4.0 * std::numbers::pi, 1e-3);
  EXPECT_DOUBLE_EQ(expected * side * side, 4.0 * std::numbers::pi);
}

TEST(RadianceMap, the_mean_of_a_quadratic_over_texels_is_its_integral) {
  // integral of x^2 / 4 pi = 1 / 3, of z = 0: equal solid angles need no weights
  const RadianceMap map(128);
  glm::dvec3 first(0.0), second(0.0);
  for (std::size_t i = 0; i < map.radiance.size(); ++i) {
    const glm::dvec3 w = map.direction(i);
    first += w;
    second += w * w;
  }
  const double n = static_cast<double>(map.radiance.size());
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(first[k] / n, 0.0, 1e-12);
    EXPECT_NEAR(second[k] / n, 1.0 / 3.0, 5e-5);
  }
}

TEST(RadianceMap, a_direction_lies_in_the_texel_whose_centre_it_is) {
  const RadianceMap map(64);
  for (std::size_t i = 0; i < map.radiance.size(); ++i)
    EXPECT_EQ(map.texel(map.direction(i)), i);
}

TEST(RadianceMap, lookup_is_continuous_across_the_folds_and_exact_at_centres) {
  const RadianceMap map =
      sampled_map(64, 1, [](const glm::dvec3& w) { return Rgb(static_cast<float>(2.0 + w.x + 0.5 * w.y * w.z)); });
  for (std::size_t i = 0; i < map.radiance.size(); ++i)
    EXPECT_NEAR(map.lookup(glm::vec3(map.direction(i))).r, map.radiance[i].r, 2e-5f);
  std::mt19937_64 engine(2);
  for (int k = 0; k < 20000; ++k) { // the lower hemisphere's meridians x = 0 and y = 0 are the square's border
    glm::dvec3 w = random_direction(engine);
    if (k % 3 == 0)
      w = glm::normalize(glm::dvec3(0.0, w.y, -std::abs(w.z)));
    EXPECT_NEAR(map.lookup(glm::vec3(w)).r, 2.0 + w.x + 0.5 * w.y * w.z,
                2e-2); // a third of a texel at a slope of 1: a fold is a kink
  }
}

TEST(RadianceMap, halving_keeps_the_mean) {
  const RadianceMap map = sampled_map(32, 1, [](const glm::dvec3& w) { return Rgb(static_cast<float>(w.z + 1.0)); });
  const auto mean = [](const RadianceMap& m) {
    double sum = 0.0;
    for (const Rgb& c : m.radiance)
      sum += static_cast<double>(c.r);
    return sum / static_cast<double>(m.radiance.size());
  };
  EXPECT_NEAR(mean(map), mean(halved(halved(map))), 1e-6);
}

TEST(RadianceMap, bad_maps_are_refused_with_their_place) {
  EXPECT_FALSE(check_map(RadianceMap(2), "here"));
  EXPECT_FALSE(check_map(RadianceMap(48), "here"));
  RadianceMap map(8);
  EXPECT_TRUE(check_map(map, "here"));
  map.radiance[5].g = -1.0f;
  EXPECT_EQ(check_map(map, "here").error().where, "here, texel 5");
  map.radiance[5].g = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(check_map(map, "here"));
  map.radiance.pop_back();
  EXPECT_FALSE(check_map(map, "here"));
}

TEST(EnvironmentMap, roughness_and_exponent_are_inverse_and_ordered) {
  for (double r = 0.1; r < 0.75; r += 0.05)
    EXPECT_NEAR(ggx_roughness(phong_exponent(r)), r, 1e-12);
  EXPECT_DOUBLE_EQ(phong_exponent(1.0), 1.0);
  EXPECT_GT(phong_exponent(0.2), phong_exponent(0.3));
}

TEST(EnvironmentMap, the_lobe_is_as_wide_as_that_of_ggx) {
  // Half of GGX's half vectors lie within tan^2(theta) = alpha^2 (Walter et al. 2007, eq. 35), so half of its mirror
  // directions within twice that angle; half of a Phong lobe lies within cos(theta)^(s + 1) = 1/2. The two families
  // differ in shape: narrower in the middle, longer tails.
  for (const double roughness : {0.1, 0.2, 0.3, 0.4}) {
    const double half_of_ggx = 2.0 * std::atan(roughness * roughness);
    const double half_of_phong = std::acos(std::pow(0.5, 1.0 / (phong_exponent(roughness) + 1.0)));
    EXPECT_NEAR(half_of_phong / half_of_ggx, std::sqrt(std::log(2.0)), 0.03) << roughness;
  }
}

TEST(EnvironmentMap, only_changed_texels_are_counted_and_an_unchanged_map_is_kept) {
  EnvironmentMap::Settings settings;
  settings.side = 32;
  settings.roughness = {0.3, 0.8};
  auto map = EnvironmentMap::create(settings);
  ASSERT_TRUE(map);
  const auto sky = [](const glm::vec3& w) { return w.z > 0 ? Rgb(1, 2, 3) : Rgb(0.1f); };
  EXPECT_EQ(*map->update(sky), std::size_t(32 * 32));
  EXPECT_EQ(*map->update(sky), std::size_t(0));
  const std::uint32_t texels[] = {7, 300};
  EXPECT_EQ(*map->update([](const glm::vec3&) { return Rgb(9); }, texels), std::size_t(2));
  EXPECT_EQ(map->sharp().radiance[300], Rgb(9));
  const std::vector<RadianceMap> before{map->level(0), map->level(1)};
  EXPECT_FALSE(map->update([](const glm::vec3&) { return Rgb(-1); }));
  EXPECT_EQ(map->level(1).radiance, before[1].radiance);
  const std::uint32_t beyond[] = {32 * 32};
  EXPECT_FALSE(map->update(sky, beyond));
}

TEST(EnvironmentMap, lookup_lies_between_the_levels_and_ends_at_the_sharp_map) {
  EnvironmentMap::Settings settings;
  settings.side = 64;
  settings.method = PrefilterMethod::exact;
  auto map = EnvironmentMap::create(settings);
  ASSERT_TRUE(map);
  ASSERT_TRUE(map->update([](const glm::vec3& w) { return w.x > 0.8f ? Rgb(50) : Rgb(1); }));
  const glm::vec3 w(1, 0, 0);
  EXPECT_EQ(map->lookup(w, std::numeric_limits<double>::infinity()), map->sharp().lookup(w));
  float last = 50.1f;
  for (double s = 100000.0; s >= 1.0; s /= 1.3) { // the light fills less and less of the lobe
    const float now = map->lookup(w, s).r;
    EXPECT_LE(now, last * 1.0001f) << s;
    last = now;
  }
  for (std::size_t k = 0; k < map->levels(); ++k)
    EXPECT_NEAR(map->lookup(w, map->exponent(k)).r, map->level(k).lookup(w).r, 1e-4f * map->level(k).lookup(w).r);
}

TEST(EnvironmentMap, bad_settings_are_refused) {
  EXPECT_FALSE(EnvironmentMap::create({100, {0.3}, PrefilterMethod::exact, 1e-3}));
  EXPECT_FALSE(EnvironmentMap::create({64, {0.0}, PrefilterMethod::exact, 1e-3}));
  EXPECT_FALSE(EnvironmentMap::create({64, {-0.5}, PrefilterMethod::exact, 1e-3}));
  EXPECT_FALSE(EnvironmentMap::create({64, {0.5, 0.4}, PrefilterMethod::exact, 1e-3}));
  EXPECT_FALSE(EnvironmentMap::create({64, {0.8, 0.9}, PrefilterMethod::exact, 1e-3}));
  EXPECT_TRUE(EnvironmentMap::create({64, {}, PrefilterMethod::exact, 1e-3}));
}

} // namespace
} // namespace daylit
