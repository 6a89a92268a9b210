// What the path tracer's own samples of a surface add up to, and which way they go.

#include <cmath>
#include <cstdint>
#include <utility>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "simulate/glossy_surface.h"
#include "simulate/low_discrepancy.h"

namespace daylit {
namespace {

constexpr float kRoughnesses[] = {0.02f, 0.05f, 0.1f, 0.2f, 0.3f, 0.5f, 0.7f, 1.0f};

SurfaceLook look_of(float roughness, float metallic, float transmission, const Rgb& colour = Rgb(1.0f)) {
  SurfaceLook look;
  look.normal = look.smooth = {0.0f, 0.0f, 1.0f};
  look.tangent = {1.0f, 0.0f, 0.0f};
  look.material.base_colour = colour;
  look.material.alpha_u = look.material.alpha_v = roughness * roughness;
  look.material.metallic = metallic;
  look.material.transmission = transmission;
  look.material.ior = 1.5f;
  return look;
}

glm::vec3 direction(float cosine, float turn) {
  const float s = std::sqrt(1.0f - cosine * cosine);
  return {s * std::cos(turn), s * std::sin(turn), cosine};
}

/// Mean of f cos / p over samples: what a white sky all around shows of the surface.
glm::dvec3 furnace(const GlossySurface& surface, std::uint32_t samples) {
  glm::dvec3 sum(0.0);
  for (std::uint32_t k = 0; k < samples; ++k) {
    const SampleStream stream(5, k);
    if (const auto in = surface.sample_glossy(stream.point(0), stream.point(1).x))
      sum += glm::dvec3(surface.glossy(*in) / surface.glossy_density(*in));
    const glm::vec2 u = stream.point(2);
    const glm::vec3 in = direction(std::sqrt(1.0f - u.x), 6.2831853f * u.y);
    sum += glm::dvec3(surface.base(in) / surface.base_density(in));
  }
  return sum / static_cast<double>(samples);
}

TEST(GlossySurface, white_layers_of_any_roughness_send_all_light_on_within_half_a_percent) {
  for (const float r : kRoughnesses)
    for (const auto& [name, look] :
         {std::pair("metal", look_of(r, 1.0f, 0.0f)), std::pair("glass", look_of(r, 0.0f, 1.0f)),
          std::pair("on white", look_of(r, 0.0f, 0.0f))})
      for (const float cosine : {1.0f, 0.7f, 0.3f}) {
        const GlossySurface surface(look, {}, direction(cosine, 0.4f));
        EXPECT_NEAR(furnace(surface, 1u << 15).x, 1.0, 0.005) << name << ", roughness " << r << ", cosine " << cosine;
      }
}

// Schlick 1994: c + (1 - c) (1 - cosine)^5. A smooth metal has no more than one reflection on its facets.
TEST(GlossySurface, coloured_metals_send_on_what_fresnel_says) {
  const Rgb gold(1.0f, 0.71f, 0.29f);
  for (const float r : {0.02f, 0.05f, 0.1f})
    for (const float cosine : {1.0f, 0.7f, 0.4f}) {
      const glm::dvec3 sum =
          furnace(GlossySurface(look_of(r, 1.0f, 0.0f, gold), {}, direction(cosine, 0.4f)), 1u << 14);
      for (int k = 0; k < 3; ++k) {
        const float c = gold[k], expected = c + (1.0f - c) * std::pow(1.0f - cosine, 5.0f);
        EXPECT_NEAR(sum[k], static_cast<double>(expected), 0.005) << r << ' ' << cosine << ' ' << k;
      }
    }
}

TEST(GlossySurface, a_path_and_its_reverse_have_the_same_value) {
  for (const auto& [a, b] : {std::pair(direction(0.9f, 0.2f), direction(0.5f, 2.1f)),
                             std::pair(direction(0.3f, 1.0f), direction(0.35f, 4.0f)),
                             std::pair(direction(0.8f, 0.2f), direction(-0.85f, 3.0f))})
    for (const float r : {0.3f, 0.6f, 1.0f}) {
      const bool through = b.z < 0.0f;
      const SurfaceLook look = look_of(r, through ? 0.0f : 1.0f, through ? 1.0f : 0.0f);
      SurfacePoint inside;
      inside.outside = !through;
      const float there = GlossySurface(look, {}, a).glossy(b).x / std::abs(b.z);
      const float back = GlossySurface(look, inside, b).glossy(a).x / std::abs(a.z) * (through ? 2.25f : 1.0f);
      ASSERT_GT(there, 0.0f);
      EXPECT_NEAR(there, back, 1e-5f * there) << r << ' ' << b.z;
    }
}

/// A cube's faces meet a window a metre away at flat angles: 2 mrad blurred its edges by more than a pixel.
TEST(GlossySurface, nine_of_ten_paths_leave_a_smooth_one_within_a_milliradian_of_the_mirrored_or_refracted_ray) {
  const float c = std::cos(0.7f), s = std::sin(0.7f);
  const GlossySurface surface(look_of(0.0f, 0.0f, 1.0f), {}, {s, 0.0f, c});
  const glm::vec3 mirrored(-s, 0.0f, c), passed(-s / 1.5f, 0.0f, -std::sqrt(1.0f - s * s / 2.25f));
  int near = 0, all = 0;
  for (std::uint32_t k = 0; k < 4096; ++k) {
    const auto part = [&](std::uint32_t step) { return static_cast<float>(k * step & 4095u) / 4096.0f; };
    const auto in = surface.sample_glossy({(static_cast<float>(k) + 0.5f) / 4096.0f, part(2531u)}, part(1237u));
    ++all;
    near += in && (glm::distance(*in, mirrored) < 1e-3f || glm::distance(*in, passed) < 1e-3f);
  }
  EXPECT_GT(near, 9 * all / 10);
}

} // namespace
} // namespace daylit
