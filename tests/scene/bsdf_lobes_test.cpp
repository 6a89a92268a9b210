// The lobes of a surface one by one, and the Lafortune lobe: energy, and agreement with their samples.

#include <array>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "bsdf_materials.h"

namespace daylit {
namespace {

using namespace test;

TEST(bsdf, a_lafortune_lobe_adds_no_light) {
  for (const glm::vec3& c : {kPhong, kBack, kBrushed, kOffSpecular})
    for (const float exponent : {1.0f, 4.0f, 30.0f, 1000.0f, LafortuneLobe::kMostExponent})
      for (const float grazing : {0.0f, 0.5f, 1.0f})
        for (const float weight : {0.2f, 1.0f}) {
          const Bsdf bsdf(lobed({Rgb(weight), c, exponent, grazing, 3.0f}));
          for (const float cosine : kCosines)
            EXPECT_LE(furnace(bsdf, direction(cosine, 0.7f), 1u << 12).x, 1.005)
                << exponent << ", grazing " << grazing << ", weight " << weight << ", cosine " << cosine;
        }
}

TEST(bsdf, a_lafortune_lobe_loses_the_cosine_and_what_falls_below_the_surface) {
  for (const float exponent : {1.0f, 10.0f, 100.0f, 5000.0f}) {
    const Bsdf mirroring(lobed({Rgb(0.8f), kPhong, exponent}, 0.0f));
    EXPECT_NEAR(furnace(mirroring, direction(1.0f, 0.0f)).x, 0.8, 0.004) << "nothing is lost along the normal";
    // Mean cosine of a power lobe: (n + 1) / (n + 2) times that of its peak, where all of it is above the surface.
    if (exponent > 50.0f) {
      EXPECT_NEAR(furnace(mirroring, direction(0.5f, 0.3f)).x, 0.4, 0.004);
    }
  }
  // n = 1, peak along the surface: 3 / (2 pi) times the integral of cos t cos s over a quarter of the sphere, 2/3.
  EXPECT_NEAR(furnace(Bsdf(lobed({Rgb(1.0f), kPhong, 1.0f}, 0.0f)), direction(1e-4f, 0.0f)).x, 1.0 / std::numbers::pi,
              0.004);
  // All of the effect at grazing angles: half of the lobe is below the surface, nothing else is lost.
  EXPECT_NEAR(furnace(Bsdf(lobed({Rgb(0.1f), kPhong, 20.0f, 1.0f}, 0.9f)), direction(1e-4f, 0.0f)).x, 0.5, 0.004);
}

TEST(bsdf, a_lafortune_lobe_rises_at_grazing_angles_as_the_paper_has_it) {
  const LafortuneLobe lobe{Rgb(0.2f), kPhong, 100.0f, 0.8f, 2.0f};
  const double f = 0.25 * 0.8; // (1 - cos)^phi f_w
  const LafortunePeak peak = lobe.peak(direction(0.5f, 0.0f));
  EXPECT_NEAR(static_cast<double>(peak.strength.r), 0.2 + 0.8 * f, 1e-4) << "eq. 11";
  EXPECT_NEAR(std::log(static_cast<double>(peak.exponent)) / std::log(1e4), 0.5 + 0.5 * f, 1e-5) << "eq. 12";
  EXPECT_NEAR(peak.direction.x, -std::sqrt(0.75f), 1e-6f) << "eq. 8";
  // Eq. 13 over a narrow lobe: g' = g + (1 - g) f.
  EXPECT_NEAR(furnace(Bsdf(lobed(lobe, 0.0f)), direction(0.5f, 0.0f)).x, (0.2 + 0.8 * f) * (0.5 + 0.5 * f), 0.003);
  EXPECT_NEAR(static_cast<double>(Bsdf(lobed(lobe)).diffuse_albedo(direction(0.5f, 0.0f)).r), 0.8 * (1.0 - f), 1e-6);
}

TEST(bsdf, mean_reflectance_of_a_lobe_is_what_comes_back_of_diffuse_light) {
  for (const float exponent : {1.0f, 5.0f, 50.0f, 1000.0f})
    for (const float grazing : {0.0f, 0.7f}) {
      const LafortuneLobe lobe{Rgb(0.6f), kPhong, exponent, grazing};
      const Bsdf bsdf(lobed(lobe, 0.3f));
      double sum = 0.0;
      for (int k = 0; k < 32; ++k) // uniform in the squared cosine
        sum += furnace(bsdf, direction(std::sqrt((static_cast<float>(k) + 0.5f) / 32.0f), 0.4f), 1u << 11).x / 32.0;
      const float stated = mean_reflectance({.base_colour = Rgb(0.3f), .lobe = lobe}).r;
      EXPECT_NEAR(static_cast<double>(stated), sum, 0.025 * sum) << exponent << ", grazing " << grazing;
    }
}

TEST(bsdf, smooth_lobes_send_what_lobes_of_nearly_smooth_facets_do) {
  SurfaceMaterial half = glass(0.0f);
  half.transmission = 0.5f;
  half.metallic = 0.3f;
  for (const SurfaceMaterial& smooth : {metal(0.0f), glass(0.0f), half, thin(0.0f)}) {
    SurfaceMaterial nearly = smooth;
    nearly.alpha_u = nearly.alpha_v = 1.5e-3f;
    const Bsdf a(smooth), b(nearly);
    for (const float cosine : {1.0f, 0.6f, 0.3f, -0.5f, -0.9f}) {
      const glm::vec3 out = direction(cosine, 0.4f);
      const auto one = a.sample_lobes(out, {0.2f, 0.3f}), other = b.sample_lobes(out, {0.2f, 0.3f});
      for (std::size_t k = 0; k < one.size(); ++k) {
        const auto weight = [](const std::optional<BsdfSample>& lobe) { return lobe ? lobe->weight : Rgb(0.0f); };
        EXPECT_LT(glm::distance(weight(one[k]), weight(other[k])), 0.01f) << cosine << ' ' << k;
        if (!one[k] || !other[k])
          continue;
        EXPECT_LT(glm::distance(one[k]->direction, other[k]->direction), 0.02f) << cosine << ' ' << k;
        EXPECT_EQ(one[k]->transmitted, other[k]->transmitted);
      }
    }
  }
}

TEST(bsdf, each_sample_of_lossless_facets_sends_on_all_light) {
  for (const float r : kRoughnesses)
    for (const auto& [name, material] :
         {std::pair("metal", metal(r)), std::pair("stretched", stretched(metal(r), 0.8f)), std::pair("glass", glass(r)),
          std::pair("diamond", glass(r, 2.42f)), std::pair("thin glass", thin(r))}) {
      const Bsdf bsdf(material);
      for (const float cosine : kCosines)
        for (std::uint32_t n = 0; n < 256; ++n) {
          float sum = 0.0f;
          for (const std::optional<BsdfSample>& lobe :
               bsdf.sample_lobes(direction(cosine, 0.7f), glm::vec2(cube_point(n, 256))))
            sum += lobe ? lobe->weight.x : 0.0f;
          ASSERT_NEAR(sum, 1.0f, 1e-3f) << name << ", roughness " << r << ", cosine " << cosine << ", sample " << n;
        }
    }
}

TEST(bsdf, lobes_send_in_the_mean_what_the_surface_reflects_and_lets_through) {
  for (const SurfaceMaterial& m : {metal(0.6f), glass(0.5f), glass(0.9f), thin(0.7f), mixture(0.5f)}) {
    SurfaceMaterial tinted = m;
    tinted.base_colour = Rgb(0.6f);
    const Bsdf bsdf(tinted);
    for (const float cosine : {0.9f, 0.3f, 0.1f, -0.2f, -0.7f}) {
      const glm::vec3 out = direction(cosine, 0.4f);
      constexpr std::uint32_t kCount = 1u << 13;
      std::array<float, 4> sent{};
      for (std::uint32_t n = 0; n < kCount; ++n) {
        const auto lobes = bsdf.sample_lobes(out, glm::vec2(cube_point(n, kCount)));
        for (std::size_t k = 0; k < 4; ++k)
          sent[k] += lobes[k] ? lobes[k]->weight.x / kCount : 0.0f;
      }
      EXPECT_NEAR(sent[1] + sent[3], bsdf.reflected_albedo(out).x, 0.01f) << cosine;
      EXPECT_NEAR(sent[2], bsdf.transmitted_albedo(out).x, 0.01f) << cosine;
    }
  }
}

TEST(bsdf, what_a_metal_would_mirror_below_the_surface_goes_anywhere) {
  for (const auto& [m, k] :
       {std::pair(metal(0.3f), 1u), std::pair(metal(0.6f), 3u), std::pair(stretched(metal(0.5f), 0.8f), 3u)}) {
    const Bsdf bsdf(m);
    const glm::vec3 out = direction(0.15f, 0.8f);
    glm::vec3 sum(0.0f);
    float found = 0.0f;
    constexpr std::uint32_t kCount = 1u << 14;
    for (std::uint32_t n = 0; n < kCount; ++n)
      if (const auto lobe = bsdf.sample_lobes(out, glm::vec2(cube_point(n, kCount)))[k];
          lobe && lobe->density == 0.0f) {
        sum += lobe->direction;
        found += 1.0f;
      }
    ASSERT_GT(found, 200.0f);
    EXPECT_LT(glm::distance(sum / found, glm::vec3(0.0f, 0.0f, 2.0f / 3.0f)), 0.05f); // of a cosine's directions
  }
}

/// Of light that falls off from the zenith to the horizon, and of light around the mirror direction.
TEST(bsdf, lobes_of_rough_metals_find_as_much_of_uneven_light_as_their_brdf) {
  constexpr std::uint32_t kCount = 1u << 14;
  for (const SurfaceMaterial& m : {metal(0.3f), metal(0.7f), stretched(metal(0.35f), 0.8f)}) {
    SurfaceMaterial steel = m;
    steel.base_colour = Rgb(0.56f);
    const Bsdf bsdf(steel);
    for (const float cosine : {0.95f, 0.6f, 0.4f}) {
      const glm::vec3 out = direction(cosine, 1.2f), mirror(-out.x, -out.y, out.z);
      float lobes[2] = {}, brdf[2] = {};
      const auto add = [&](const BsdfSample& s, float(&sum)[2]) {
        sum[0] += s.weight.x * s.direction.z / kCount;
        sum[1] += s.weight.x * std::pow(std::max(glm::dot(s.direction, mirror), 0.0f), 4.0f) / kCount;
      };
      for (std::uint32_t n = 0; n < kCount; ++n) {
        const glm::vec3 u = cube_point(n, kCount);
        for (const std::optional<BsdfSample>& lobe : bsdf.sample_lobes(out, glm::vec2(u)))
          if (lobe)
            add(*lobe, lobes);
        if (const auto s = bsdf.sample_glossy(out, u))
          add(*s, brdf);
      }
      for (const int k : {0, 1})
        EXPECT_NEAR(lobes[k] / brdf[k], 1.0f, 0.02f) << cosine << ' ' << k;
    }
  }
}

TEST(bsdf, mirroring_lobes_are_those_of_the_samples) {
  for (const SurfaceMaterial& m : {metal(0.3f), stretched(metal(0.5f), 0.8f), coated(mixture(0.5f), 0.3f), glass(0.4f),
                                   lobed({Rgb(0.5f), {-1.0f, -1.0f, 0.9f}, 20.0f, 0.5f})}) {
    const Bsdf bsdf(m);
    for (const float cosine : {0.9f, 0.4f, -0.7f}) {
      const glm::vec3 out = direction(cosine, 0.4f);
      std::array<float, 3> sampled{}, integral{}, whole{};
      constexpr std::uint32_t kCount = 20000;
      for (std::uint32_t n = 0; n < kCount; ++n) {
        const glm::vec3 u = cube_point(n, kCount);
        const auto lobes = bsdf.sample_lobes(out, glm::vec2(u));
        glm::vec3 in = direction(u.x, 6.2831853f * u.y); // evenly over the half
        in.z *= cosine < 0.0f ? -1.0f : 1.0f;
        const auto there = bsdf.mirroring_lobes(out, in);
        for (std::size_t k = 0; k < 3; ++k) {
          if (there[k]) {
            integral[k] += 6.2831853f / kCount * there[k]->weight.x * there[k]->density;
            whole[k] += 6.2831853f / kCount * there[k]->density;
          }
          if (!lobes[k] || lobes[k]->transmitted)
            continue;
          if (lobes[k]->density == 0.0f) // turned up from below the surface
            continue;
          sampled[k] += lobes[k]->weight.x / kCount;
          const auto same = bsdf.mirroring_lobes(out, lobes[k]->direction)[k];
          ASSERT_TRUE(same);
          EXPECT_NEAR(same->weight.x, lobes[k]->weight.x, 1e-3f);
          EXPECT_NEAR(same->density, lobes[k]->density, 0.01f * lobes[k]->density);
        }
      }
      for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_NEAR(integral[k], sampled[k], 0.01f) << cosine << ' ' << k;
        EXPECT_LT(whole[k], 1.01f);
      }
      EXPECT_GT(sampled[1], 0.01f);
    }
  }
}

} // namespace
} // namespace daylit
