#include "scene/material/library.h"

#include <algorithm>
#include <limits>

#include <gtest/gtest.h>

namespace daylit {
namespace {

TEST(MaterialLibrary, has_at_least_fifteen_valid_materials_in_order) {
  const std::vector<std::string> names = library_names();
  EXPECT_GE(names.size(), 15u);
  EXPECT_TRUE(std::ranges::is_sorted(names));
  for (const std::string& name : names) {
    const auto m = library_material(name);
    ASSERT_TRUE(m) << name;
    EXPECT_TRUE(check_material(*m, name)) << name;
    EXPECT_EQ(m->name, name);
    const Rgb r = mean_reflectance(*m);
    for (int c = 0; c < 3; ++c) {
      EXPECT_GT(r[c], 0.0f) << name;
      EXPECT_LE(r[c], 1.0f) << name;
    }
  }
}

TEST(MaterialLibrary, an_unknown_name_is_an_error_with_all_names) {
  const auto m = library_material("chrom");
  ASSERT_FALSE(m);
  for (const std::string& name : library_names())
    EXPECT_NE(m.error().message().find(name), std::string::npos);
}

TEST(MaterialLibrary, only_plaster_is_diffuse) {
  for (const std::string& name : library_names())
    EXPECT_EQ(library_material(name)->is_glossy(), name != "plaster") << name;
}

TEST(MaterialLibrary, water_takes_more_red_than_blue) {
  const Rgb a = library_material("water")->absorption_per_m();
  EXPECT_NEAR(a.r, 0.264f, 1e-3f);
  EXPECT_NEAR(a.b, 0.0101f, 1e-4f);
}

TEST(Material, numbers_out_of_range_are_errors_that_name_them) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::pair<void (*)(ObjectMaterial&, float), const char*> fields[] = {
      {[](ObjectMaterial& m, float v) { m.roughness = v; }, "roughness"},
      {[](ObjectMaterial& m, float v) { m.metallic = v; }, "metallic"},
      {[](ObjectMaterial& m, float v) { m.base_colour.g = v; }, "base colour (green)"},
      {[](ObjectMaterial& m, float v) { m.ior = v; }, "index of refraction"},
      {[](ObjectMaterial& m, float v) { m.transmission = v; }, "transmission"},
      {[](ObjectMaterial& m, float v) { m.clearcoat = v; }, "clear coat"},
      {[](ObjectMaterial& m, float v) { m.emission.b = v; }, "emission (blue)"},
      {[](ObjectMaterial& m, float v) { m.anisotropy = v; }, "anisotropy"}};
  for (const auto& [set, name] : fields)
    for (const float bad : {-0.1f, nan, std::numeric_limits<float>::infinity()}) {
      ObjectMaterial m;
      set(m, bad);
      const auto checked = check_material(m, "cup.glb, material 3");
      ASSERT_FALSE(checked) << name;
      EXPECT_NE(checked.error().message().find(name), std::string::npos) << checked.error().message();
      EXPECT_NE(checked.error().message().find("cup.glb, material 3"), std::string::npos);
    }
}

/// Mean over the hemisphere, cosine weighted, of Fresnel's equations.
double fresnel_mean(double n) {
  double sum = 0.0;
  const int steps = 4000;
  for (int k = 0; k < steps; ++k) {
    const double c = std::sqrt((k + 0.5) / steps), t = std::sqrt(1.0 - (1.0 - c * c) / (n * n));
    const double s = (c - n * t) / (c + n * t), p = (n * c - t) / (n * c + t);
    sum += 0.5 * (s * s + p * p) / steps;
  }
  return sum;
}

TEST(Material, diffuse_light_comes_back_as_fresnel_says) {
  for (const float n : {1.1f, 1.33f, 1.5f, 2.0f, 2.5f}) {
    const double f = fresnel_mean(static_cast<double>(n)); // midpoint rule: 1e-5
    const ObjectMaterial black{.base_colour = Rgb(0.0f), .roughness = 0.1f, .ior = n},
        glass{.base_colour = Rgb(1.0f), .roughness = 0.0f, .ior = n, .transmission = 1.0f};
    EXPECT_NEAR(mean_reflectance(black).r, f, 1e-4) << n;
    EXPECT_NEAR(mean_reflectance(glass).r, 2.0 * f / (1.0 + f), 1e-4) << n;
  }
  EXPECT_EQ(mean_reflectance({.base_colour = Rgb(0.3f)}), Rgb(0.3f)) << "diffuse: the base colour and nothing else";
  EXPECT_NEAR(mean_reflectance({.base_colour = Rgb(1.0f), .metallic = 1.0f}).g, 1.0f, 1e-6f);
}

TEST(Material, the_diffuse_part_is_what_a_black_base_takes_away) {
  for (const float coat : {0.0f, 0.7f})
    for (const float metallic : {0.0f, 0.3f}) {
      ObjectMaterial m{.base_colour = Rgb(0.6f), .metallic = metallic, .roughness = 0.3f, .clearcoat = coat};
      ObjectMaterial black = m;
      black.base_colour = Rgb(0.0f);
      const float of_metal = (1.0f - coat * mean_reflectance({.base_colour = Rgb(0.0f), .roughness = 0.3f}).g) *
                             metallic * 20.0f / 21.0f * 0.6f;
      EXPECT_NEAR(mean_diffuse_reflectance(m).g, mean_reflectance(m).g - mean_reflectance(black).g - of_metal, 1e-5f);
    }
  EXPECT_EQ(mean_diffuse_reflectance({.base_colour = Rgb(0.3f)}), Rgb(0.3f));
  EXPECT_EQ(mean_diffuse_reflectance({.base_colour = Rgb(1.0f), .metallic = 1.0f}), Rgb(0.0f));
  EXPECT_EQ(mean_diffuse_reflectance({.roughness = 0.0f, .transmission = 1.0f}), Rgb(0.0f));
}

} // namespace
} // namespace daylit
