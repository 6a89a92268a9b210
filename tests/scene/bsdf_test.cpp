// Reflection and transmission: energy, reciprocity, and samples that agree with their density.

#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "bsdf_materials.h"
#include "scene/material/fresnel.h"

namespace daylit {
namespace {

using namespace test;

constexpr float kPi = std::numbers::pi_v<float>;

TEST(fresnel, normal_incidence_brewster_and_total_reflection) {
  for (const float n : {1.1f, 1.33f, 1.5f, 2.4f}) {
    const float r = (n - 1.0f) / (n + 1.0f);
    EXPECT_NEAR(fresnel_dielectric(1.0f, n), r * r, 1e-6f) << n;
    EXPECT_NEAR(fresnel_dielectric(-1.0f, n), r * r, 1e-6f) << n;
    // tan b = n: light in the plane of incidence is not reflected, the other half is by ((n^2 - 1) / (n^2 + 1))^2.
    const float across = (n * n - 1.0f) / (n * n + 1.0f);
    EXPECT_NEAR(fresnel_dielectric(1.0f / std::sqrt(1.0f + n * n), n), 0.5f * across * across, 1e-6f) << n;
    const float critical = std::sqrt(1.0f - 1.0f / (n * n));
    EXPECT_EQ(fresnel_dielectric(-0.999f * critical, n), 1.0f) << n;
    EXPECT_LT(fresnel_dielectric(-1.001f * critical, n), 1.0f) << n;
  }
}

TEST(fresnel, is_the_same_along_a_ray_and_back) {
  for (float c = 0.05f; c < 1.0f; c += 0.1f) {
    const auto inside = refracted(direction(c, 0.3f), {0.0f, 0.0f, 1.0f}, 1.5f);
    ASSERT_TRUE(inside);
    EXPECT_NEAR(std::hypot(inside->x, inside->y) * 1.5f, std::sqrt(1.0f - c * c), 1e-6f) << "Snell at " << c;
    // Back outside, the rounding of the cosine inside has grown by n^2 / c.
    EXPECT_NEAR(fresnel_dielectric(inside->z, 1.5f), fresnel_dielectric(c, 1.5f), 1e-6f / c) << c;
  }
}

TEST(fresnel, mean_agrees_with_what_comes_back_from_inside) {
  // n^2 (1 - F_inside) = 1 - F_outside: as much light enters as leaves in equilibrium.
  EXPECT_NEAR(1.5f * 1.5f * (1.0f - mean_fresnel(1.0f / 1.5f)), 1.0f - mean_fresnel(1.5f), 1e-3f);
}

/// Sample, inverse and density belong together: back to the place in the square, and the area in the square that a
/// solid angle about the normal comes from is the density.
TEST(ggx, inverse_of_a_sample_is_its_place_and_its_jacobian_the_density) {
  for (const Ggx& facets : {Ggx{0.05f, 0.05f}, Ggx{0.4f, 0.4f}, Ggx{0.1f, 0.7f}, Ggx{1.0f, 1.0f}})
    for (const glm::vec3& w :
         {glm::vec3(0, 0, 1), glm::normalize(glm::vec3(0.8, -0.3, 0.5)), glm::normalize(glm::vec3(-2.0, 1.0, 0.3))})
      for (float u = 0.13f; u < 1.0f; u += 0.2f)
        for (float v = 0.07f; v < 0.95f; v += 0.2f) {
          const glm::vec3 h = facets.sample_visible(w, {u, v});
          const glm::vec2 back = facets.invert_visible(w, h);
          EXPECT_NEAR(back.x, u, 2e-3f);
          EXPECT_NEAR(back.y, v, 2e-3f);
          constexpr float kStep = 2e-3f;
          const glm::vec3 along_u = facets.sample_visible(w, {u + kStep, v}) - facets.sample_visible(w, {u - kStep, v}),
                          along_v = facets.sample_visible(w, {u, v + kStep}) - facets.sample_visible(w, {u, v - kStep});
          const float solid_angle = glm::length(glm::cross(along_u, along_v));
          EXPECT_NEAR(solid_angle * facets.visible_density(w, h), 4.0f * kStep * kStep, 0.02f * 4.0f * kStep * kStep)
              << facets.alpha_u << ' ' << facets.alpha_v << ' ' << u << ' ' << v;
        }
}

TEST(bsdf, white_furnace_is_closed_within_half_a_percent) {
  for (const float r : kRoughnesses)
    for (const auto& [name, material] :
         {std::pair("metal", metal(r)), std::pair("dielectric on white", rough(r)), std::pair("glass", glass(r)),
          std::pair("glass of 1.33", glass(r, 1.33f)), std::pair("diamond", glass(r, 2.42f)),
          std::pair("thin glass", thin(r)), std::pair("mixture", mixture(r))}) {
      const Bsdf bsdf(material);
      for (const float cosine : kCosines)
        EXPECT_NEAR(furnace(bsdf, direction(cosine, 0.7f)).x, 1.0, 0.005)
            << name << ", roughness " << r << ", cosine " << cosine;
    }
}

TEST(bsdf, coats_and_stretched_facets_add_no_light) {
  for (const float r : kRoughnesses)
    for (const auto& [name, material, least] :
         {std::tuple("metal", coated(metal(r), 0.1f), 0.95), std::tuple("white", coated(rough(r), 0.3f), 0.99),
          std::tuple("glass", coated(glass(r), 0.3f), 0.93), std::tuple("stretched", stretched(metal(r), 0.5f), 0.99),
          std::tuple("much stretched", stretched(metal(r), 1.0f), 0.99),
          std::tuple("stretched white", stretched(rough(r), 0.5f), 0.98)}) {
      const Bsdf bsdf(material);
      for (const float cosine : kCosines) {
        const double sum = furnace(bsdf, direction(cosine, 0.7f), 1u << 12).x;
        EXPECT_LE(sum, 1.005) << name << ", roughness " << r << ", cosine " << cosine;
        EXPECT_GE(sum, least) << name << ", roughness " << r << ", cosine " << cosine;
      }
    }
}

TEST(bsdf, a_grey_metal_keeps_less_than_its_colour_at_normal_incidence) {
  SurfaceMaterial m = metal(0.05f);
  m.base_colour = {0.9f, 0.5f, 0.1f};
  const glm::dvec3 smooth = furnace(Bsdf(m), direction(1.0f, 0.0f));
  for (int k = 0; k < 3; ++k)
    EXPECT_NEAR(smooth[k], m.base_colour[k], 0.005) << k;
}

TEST(bsdf, is_reciprocal_with_the_squared_index) {
  for (const SurfaceMaterial& m : {metal(0.3f), rough(0.4f), glass(0.5f), glass(0.3f, 1.33f), thin(0.4f), mixture(0.6f),
                                   coated(mixture(0.5f), 0.3f), stretched(mixture(0.4f), 0.7f),
                                   lobed({Rgb(0.4f), kBrushed, 12.0f}), lobed({Rgb(0.4f), kBack, 3.0f})}) {
    const Bsdf bsdf(m);
    int compared = 0;
    for (std::uint32_t n = 0; n < 400; ++n) {
      const glm::vec3 u = cube_point(n, 400);
      const glm::vec3 a = direction(2.0f * u.x - 1.0f, 6.0f * u.y), b = direction(2.0f * u.z - 1.0f, 6.0f * u.x);
      if (std::abs(a.z) < 0.02f || std::abs(b.z) < 0.02f)
        continue;
      const bool solid = m.transmission > 0.0f && !m.thin;
      const float index_a = solid && a.z < 0.0f ? m.ior : 1.0f, index_b = solid && b.z < 0.0f ? m.ior : 1.0f;
      const Rgb there = bsdf.f(a, b) * (index_a * index_a), back = bsdf.f(b, a) * (index_b * index_b);
      for (int k = 0; k < 3; ++k)
        EXPECT_NEAR(there[k], back[k], 1e-5f * there[k] + 1e-7f) << n;
      compared += there.x > 0.0f;
    }
    EXPECT_GT(compared, 100);
  }
}

TEST(bsdf, weight_of_a_sample_is_value_times_cosine_over_density) {
  for (const SurfaceMaterial& m : {metal(0.02f), glass(0.02f), coated(mixture(0.5f), 0.3f), thin(0.4f),
                                   lobed({Rgb(0.4f), kBrushed, 200.0f, 0.6f})}) {
    const Bsdf bsdf(m);
    for (std::uint32_t n = 0; n < 500; ++n) {
      const glm::vec3 out = direction(n % 2 == 0 ? 0.6f : -0.7f, 1.0f);
      for (const bool glossy : {false, true}) {
        const glm::vec3 u = cube_point(n, 500);
        const auto s = glossy ? bsdf.sample_glossy(out, u) : bsdf.sample(out, u);
        if (!s)
          continue;
        const Rgb f = glossy ? bsdf.glossy(out, s->direction) : bsdf.f(out, s->direction);
        const float p = glossy ? bsdf.glossy_density(out, s->direction) : bsdf.density(out, s->direction);
        EXPECT_NEAR(glm::length(s->direction), 1.0f, 1e-5f);
        EXPECT_EQ(s->transmitted, s->direction.z * out.z < 0.0f);
        EXPECT_NEAR(s->density, p, 1e-4f * p);
        const float weight = f.x * std::abs(s->direction.z) / p;
        EXPECT_NEAR(s->weight.x, weight, 1e-4f * weight);
      }
    }
  }
}

/// Cells of equal solid angle: their samples against the integral of the density, chi-square.
void expect_samples_as_density(const Bsdf& bsdf, const glm::vec3& out, const std::string& name) {
  constexpr int kRows = 24, kColumns = 12, kFine = 16;
  constexpr std::uint32_t kCount = 1u << 17;
  std::vector<double> found(kRows * kColumns, 0.0), expected(kRows * kColumns, 0.0);
  std::uint32_t seed = 12345;
  const auto random = [&] {
    seed = seed * 1664525u + 1013904223u;
    return static_cast<float>(seed >> 8) * 0x1p-24f;
  };
  double kept = 0.0;
  for (std::uint32_t n = 0; n < kCount; ++n) {
    const float x = random(), y = random(), z = random();
    const auto s = bsdf.sample(out, {x, y, z});
    if (!s)
      continue;
    kept += 1.0;
    const float turn = std::atan2(s->direction.y, s->direction.x) / (2.0f * kPi);
    const int row = std::min(kRows - 1, static_cast<int>((s->direction.z + 1.0f) / 2.0f * kRows));
    const int column = std::min(kColumns - 1, static_cast<int>((turn < 0.0f ? turn + 1.0f : turn) * kColumns));
    found[row * kColumns + column] += 1.0;
  }
  double integral = 0.0;
  for (int i = 0; i < kRows * kFine; ++i)
    for (int j = 0; j < kColumns * kFine; ++j) {
      const float z = 2.0f * (static_cast<float>(i) + 0.5f) / (kRows * kFine) - 1.0f;
      const float turn = (static_cast<float>(j) + 0.5f) / (kColumns * kFine);
      const double p = static_cast<double>(bsdf.density(out, direction(z, 2.0f * kPi * turn))) * 4.0 *
                       std::numbers::pi / (kRows * kFine * kColumns * kFine);
      integral += p;
      expected[i / kFine * kColumns + j / kFine] += p * kCount;
    }
  EXPECT_NEAR(integral, kept / kCount, 0.005) << name;
  double chi2 = 0.0;
  int cells = 0;
  for (std::size_t k = 0; k < found.size(); ++k)
    if (expected[k] > 20.0) {
      // Half a percent for the midpoint rule.
      const double spread = expected[k] + std::pow(0.005 * expected[k], 2);
      chi2 += (found[k] - expected[k]) * (found[k] - expected[k]) / spread;
      ++cells;
    }
  // Mean `cells`, variance 2 `cells`: five sigma.
  EXPECT_LT(chi2, cells + 5.0 * std::sqrt(2.0 * cells)) << name;
  EXPECT_GT(cells, 20) << name;
}

TEST(bsdf, samples_follow_their_density) {
  for (const auto& [name, material] :
       {std::pair("metal", metal(0.6f)), std::pair("dielectric", rough(0.7f)), std::pair("glass", glass(0.7f)),
        std::pair("thin", thin(0.7f)), std::pair("coated mixture", coated(mixture(0.8f), 0.6f)),
        std::pair("stretched", stretched(glass(0.6f), 0.6f)),
        std::pair("lobe", lobed({Rgb(0.6f), kBrushed, 8.0f, 0.5f, 2.0f}))})
    for (const float cosine : {0.3f, 0.9f, -0.4f, -0.9f})
      expect_samples_as_density(Bsdf(material), direction(cosine, 0.7f), fmt::format("{} {}", name, cosine));
}

TEST(bsdf, parts_sum_to_the_whole) {
  for (const SurfaceMaterial& m : {rough(0.4f), mixture(0.5f), coated(mixture(0.5f), 0.3f)}) {
    const Bsdf bsdf(m);
    const glm::vec3 out = direction(0.5f, 0.2f), in = direction(0.7f, 3.0f);
    EXPECT_NEAR(bsdf.f(out, in).x, bsdf.glossy(out, in).x + bsdf.diffuse(out, in).x, 1e-6f);
    glm::dvec3 glossy(0.0);
    constexpr std::uint32_t kCount = 1u << 14;
    for (std::uint32_t n = 0; n < kCount; ++n)
      if (const auto s = bsdf.sample_glossy(out, cube_point(n, kCount)))
        glossy += glm::dvec3(s->weight);
    EXPECT_NEAR(glossy.x / kCount + static_cast<double>(bsdf.diffuse_albedo(out).x), furnace(bsdf, out).x, 2e-3);
    const auto stated = static_cast<double>(bsdf.reflected_albedo(out).x + bsdf.transmitted_albedo(out).x);
    EXPECT_NEAR(glossy.x / kCount, stated, m.clearcoat > 0.0f ? 0.05 : 2e-3);
  }
}

TEST(bsdf, smooth_glass_bends_light_as_snell_says_and_loses_what_fresnel_says) {
  const Bsdf bsdf(glass(0.0f));
  const glm::vec3 out = direction(0.6f, 0.0f);
  const auto through = refracted(out, {0.0f, 0.0f, 1.0f}, 1.5f);
  EXPECT_NEAR(bsdf.reflected_albedo(out).x, fresnel_dielectric(0.6f, 1.5f), 2e-3f);
  int passed = 0;
  for (std::uint32_t n = 0; n < 200; ++n)
    if (const auto s = bsdf.sample(out, cube_point(n, 200)); s && s->transmitted) {
      EXPECT_NEAR(s->weight.x, 1.0f, 2e-3f);
      passed += glm::distance(s->direction, *through) < 0.02f;
    }
  EXPECT_GT(passed, 170);
}

TEST(bsdf, stays_finite_at_the_edges_of_its_domain) {
  for (SurfaceMaterial m : {metal(0.0f), glass(0.0f), glass(1.0f), glass(0.0f, 1.0f), coated(glass(0.0f), 0.0f),
                            stretched(metal(0.0f), 1.0f), glass(0.2f, 50.0f),
                            lobed({Rgb(1.0f), kPhong, LafortuneLobe::kMostExponent, 1.0f, 0.1f}),
                            lobed({Rgb(0.0f), {-1e-3f, -1e3f, 1e-6f}, 1.0f})})
    for (const float colour : {0.0f, 1.0f}) {
      m.base_colour = Rgb(colour);
      const Bsdf bsdf(m);
      for (const float cosine : {0.0f, 1e-7f, 1e-4f, 0.5f, 1.0f, -1e-7f, -1e-4f, -0.5f, -1.0f})
        for (std::uint32_t n = 0; n < 64; ++n) {
          const glm::vec3 out = direction(cosine, 0.4f);
          glm::vec3 u = cube_point(n, 64);
          if (n == 0)
            u = {0.0f, 0.0f, 0.0f};
          if (n == 1)
            u = glm::vec3(1.0f - 0x1p-24f);
          const auto s = bsdf.sample(out, u);
          if (!s)
            continue;
          EXPECT_TRUE(std::isfinite(s->weight.x) && std::isfinite(s->density)) << cosine << ' ' << n;
          EXPECT_TRUE(std::isfinite(bsdf.f(out, s->direction).x)) << cosine << ' ' << n;
          EXPECT_GE(s->weight.x, 0.0f);
        }
    }
}

} // namespace
} // namespace daylit
