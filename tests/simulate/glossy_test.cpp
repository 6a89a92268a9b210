// Paths through objects that mirror and refract, against closed forms.

#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "scene/material/fresnel.h"
#include "simulate/glossy_surface.h"
#include "simulate/low_discrepancy.h"
#include "simulate/path_tracer.h"
#include "tests/simulate/shiny_objects.h"

namespace daylit {
namespace {

using namespace test;

constexpr float kPi = std::numbers::pi_v<float>;

SkyModel uniform_sky(float above, float below) {
  SkyModel sky;
  sky.kind = SkyModel::Kind::uniform;
  sky.zenith_radiance = Rgb(above);
  sky.ground_radiance = Rgb(below);
  sky.ground_albedo = -1.0f;
  return sky;
}

/// A room that nobody sees: one speck.
Room no_room() {
  Room room;
  room.vertices = {{5, 5, 5}, {5.001, 5, 5}, {5, 5.001, 5}};
  room.materials = {{"black", Rgb(0.0f), Rgb(1.0f), false}};
  room.triangles = {{{0, 1, 2}, 0}};
  return room;
}

/// Unit cube, open at y = 0, red and green walls, so that directions can be told.
Room coloured_cube() {
  Room room;
  for (int k = 0; k < 8; ++k)
    room.vertices.emplace_back(k & 1, (k >> 1) & 1, (k >> 2) & 1);
  room.materials = {{"grey", Rgb(0.5f), Rgb(1.0f), false},
                    {"red", {0.8f, 0.1f, 0.1f}, Rgb(1.0f), false},
                    {"green", {0.1f, 0.8f, 0.1f}, Rgb(1.0f), false}};
  const std::array<std::uint32_t, 4> sides[] = {{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 2, 6, 4}, {1, 5, 7, 3}, {2, 3, 7, 6}};
  for (std::uint32_t k = 0; k < 5; ++k) {
    const auto& q = sides[k];
    const std::uint32_t material = k == 2 ? 1 : k == 3 ? 2 : 0;
    room.triangles.push_back({{q[0], q[1], q[2]}, material});
    room.triangles.push_back({{q[0], q[2], q[3]}, material});
  }
  return room;
}
const std::vector<Aperture> kOpenFace = {{{{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1}}, {0, 1, 0}, Rgb(1.0f)}};

TraceScene scene_of(const Room& room, const std::vector<Aperture>& openings, const SkyLight& sky,
                    const ObjectMesh& object) {
  auto scene = TraceScene::make(room, openings, sky, &object);
  EXPECT_TRUE(scene) << scene.error().message();
  return *std::move(scene);
}

struct Mean {
  glm::dvec3 value{0.0}, standard_error{0.0};
};
/// Of `samples` paths along a ray; `spread`: radius of the cone of directions, radians.
Mean radiance(const TraceScene& scene, const glm::dvec3& from, const glm::vec3& direction, std::uint32_t samples,
              std::uint32_t key = 7, float spread = 0.0f) {
  const PathTracer tracer(scene);
  const glm::vec3 d = glm::normalize(direction);
  const glm::vec3 t = glm::normalize(glm::cross(d, std::abs(d.z) < 0.9f ? glm::vec3(0, 0, 1) : glm::vec3(1, 0, 0)));
  constexpr std::uint32_t kBatches = 16;
  std::array<glm::dvec3, kBatches> batch{};
  Mean mean;
  for (std::uint32_t b = 0; b < kBatches; ++b) {
    for (std::uint32_t n = 0; n < samples / kBatches; ++n) {
      const SampleStream stream(combine_keys(key, b), n);
      const glm::vec2 u = stream.point(100);
      const float r = spread * std::sqrt(u.x), a = 2.0f * kPi * u.y;
      const glm::vec3 ray = glm::normalize(d + r * (std::cos(a) * t + std::sin(a) * glm::cross(d, t)));
      batch[b] += glm::dvec3(tracer.radiance(scene.to_local(from), ray, stream, true).value);
    }
    batch[b] /= samples / kBatches;
    mean.value += batch[b] / static_cast<double>(kBatches);
  }
  for (const glm::dvec3& b : batch)
    mean.standard_error += (b - mean.value) * (b - mean.value) / static_cast<double>(kBatches * (kBatches - 1));
  mean.standard_error = glm::sqrt(mean.standard_error);
  return mean;
}

TEST(Glossy, white_objects_vanish_under_an_even_sky) {
  ObjectMaterial thin = glass(0.2f), coated = metal(0.3f), brushed = metal(0.3f);
  thin.thin = true;
  coated.clearcoat = 1.0f;
  brushed.anisotropy = 0.6f;
  for (const auto& [name, material, least] :
       {std::tuple("mirror", metal(0.0f), 0.99), std::tuple("rough metal", metal(0.4f), 0.99),
        std::tuple("rougher metal", metal(0.9f), 0.99), std::tuple("varnish", varnish(0.2f), 0.99),
        std::tuple("rough varnish", varnish(0.8f), 0.99), std::tuple("clear glass", glass(0.0f), 0.99),
        std::tuple("frosted glass", glass(0.5f), 0.99), std::tuple("thin glass", thin, 0.99),
        std::tuple("coated metal", coated, 0.96), std::tuple("brushed metal", brushed, 0.99)}) {
    const TraceScene scene =
        scene_of(no_room(), {}, SkyLight(uniform_sky(1.0f, 1.0f)), sphere({0, 0, 0}, 0.5f, material));
    for (const float height : {0.0f, 0.3f, 0.45f}) {
      const Mean m = radiance(scene, {-2, 0, height}, {1, 0, 0}, 4096);
      EXPECT_LE(m.value.x, 1.005 + 4.0 * m.standard_error.x) << name << " at " << height;
      EXPECT_GE(m.value.x, least - 4.0 * m.standard_error.x) << name << " at " << height;
      EXPECT_LT(m.standard_error.x, 0.025) << name << " at " << height;
    }
  }
}

ObjectMaterial lobed(const glm::vec3& c, float exponent, float grazing) {
  ObjectMaterial m = varnish(1.0f);
  m.base_colour = Rgb(0.6f);
  m.lobe = LafortuneLobe{Rgb(0.4f), c, exponent, grazing, 3.0f};
  return m;
}

// A sphere of radius 1/2: the cosine at height h is sqrt(1 - 4 h^2). A narrow lobe that mirrors, or sends back, has the
// cosine's part of its weight.
TEST(Glossy, a_lobe_under_an_even_sky_sends_what_its_weight_and_the_cosine_say) {
  for (const auto& [c, grazing] : {std::pair(glm::vec3(-1, -1, 1), 0.0f), std::pair(glm::vec3(1, 1, 1), 0.0f),
                                   std::pair(glm::vec3(-1, -1, 1), 1.0f)}) {
    const TraceScene scene =
        scene_of(no_room(), {}, SkyLight(uniform_sky(1.0f, 1.0f)), sphere({0, 0, 0}, 0.5f, lobed(c, 300.0f, grazing)));
    for (const float height : {0.0f, 0.25f, 0.4f}) {
      const double cosine = std::sqrt(1.0 - static_cast<double>(4.0f * height * height));
      const double f = static_cast<double>(grazing) * std::pow(1.0 - cosine, 3.0);
      const double expected = 0.6 * (1.0 - f) + (0.4 + 0.6 * f) * (cosine + (1.0 - cosine) * f);
      const Mean m = radiance(scene, {-2, 0, height}, {1, 0, 0}, 4096);
      EXPECT_NEAR(m.value.x, expected, 0.01 + 4.0 * m.standard_error.x) << height << ", " << grazing;
    }
  }
}

TEST(Glossy, a_mirror_shows_what_is_seen_along_the_reflected_ray) {
  const TraceScene scene = scene_of(coloured_cube(), kOpenFace, SkyLight(uniform_sky(1.0f, 0.2f)),
                                    sphere({0.5f, 0.5f, 0.5f}, 0.2f, metal(0.0f, {0.9f, 0.6f, 0.3f})));
  for (const glm::vec3 aim :
       {glm::vec3(0.62f, 0.5f, 0.55f), glm::vec3(0.38f, 0.5f, 0.42f), glm::vec3(0.5f, 0.5f, 0.58f)}) {
    const glm::vec3 from(0.5f, 0.02f, 0.5f), d = glm::normalize(aim - from);
    bool touched = false;
    const auto hit = scene.closest(scene.to_local(from), d, true, touched);
    ASSERT_TRUE(hit && hit->on_object);
    const glm::vec3 reflected = glm::reflect(d, hit->normal);
    const Mean seen = radiance(scene, from, d, 1u << 14);
    const glm::dvec3 start =
        glm::dvec3(hit->position + 1e-4f * hit->normal) + glm::dvec3(from) - glm::dvec3(scene.to_local(from));
    const Mean straight = radiance(scene, start, reflected, 1u << 14, 11);
    for (int k = 0; k < 3; ++k) {
      const float colour = glm::vec3(0.9f, 0.6f, 0.3f)[k];
      const float rest = 1.0f + glm::dot(d, hit->normal); // 1 - cosine
      const double expected = static_cast<double>(colour + (1.0f - colour) * std::pow(rest, 5.0f)) * straight.value[k];
      EXPECT_NEAR(seen.value[k], expected,
                  0.01 * expected + 4.0 * (seen.standard_error[k] + straight.standard_error[k]));
    }
  }
}

// Slab: T = (1 - R)^2 e / (1 - R^2 e^2) and R (1 + (1 - R)^2 e^2 / (1 - R^2 e^2)), e = exp(-a d); clear: (1 - R) / (1 +
// R).
TEST(Glossy, a_slab_passes_and_mirrors_what_the_closed_form_says) {
  for (const float absorption : {0.0f, 4.0f})
    for (const float cosine : {1.0f, 0.6f}) {
      ObjectMaterial m = glass(0.0f);
      m.attenuation_colour = Rgb(std::exp(-absorption));
      m.attenuation_distance_m = 1.0f;
      const TraceScene scene =
          scene_of(no_room(), {}, SkyLight(uniform_sky(1.0f, 0.0f)), box({-20, -20, -0.1f}, {20, 20, 0.1f}, m));
      const double r = static_cast<double>(fresnel_dielectric(cosine, 1.5f));
      const double inside = std::sqrt(1.0 - static_cast<double>(1.0f - cosine * cosine) / 2.25);
      const double e = std::exp(-static_cast<double>(absorption) * 0.2 / inside);
      const double passed = (1 - r) * (1 - r) * e / (1 - r * r * e * e);
      const double mirrored = r * (1 + (1 - r) * (1 - r) * e * e / (1 - r * r * e * e));
      const glm::vec3 up(std::sqrt(1.0f - cosine * cosine), 0.0f, cosine);
      const Mean through = radiance(scene, {0, 0, -1}, up, 1u << 15);
      const Mean back = radiance(scene, {0, 0, 1}, glm::vec3(up.x, 0.0f, -up.z), 1u << 15);
      EXPECT_NEAR(through.value.x, passed, 0.003 + 4.0 * through.standard_error.x) << absorption << ' ' << cosine;
      EXPECT_NEAR(back.value.x, mirrored, 0.003 + 4.0 * back.standard_error.x) << absorption << ' ' << cosine;
    }
}

TEST(Glossy, a_glass_ball_turns_the_picture_upside_down) {
  const TraceScene scene =
      scene_of(no_room(), {}, SkyLight(uniform_sky(1.0f, 0.0f)), sphere({0, 0, 0}, 0.5f, glass(0.0f)));
  EXPECT_LT(radiance(scene, {-2, 0, 0.15}, {1, 0, 0}, 4096).value.x, 0.1);
  EXPECT_GT(radiance(scene, {-2, 0, -0.15}, {1, 0, 0}, 4096).value.x, 0.9);
}

TEST(Glossy, light_found_through_an_opening_agrees_with_light_found_by_chance) {
  ObjectMaterial coated = varnish(0.5f), half = glass(0.3f);
  coated.base_colour = {0.7f, 0.3f, 0.2f};
  coated.clearcoat = 1.0f;
  half.transmission = 0.5f;
  for (const auto& [name, material] :
       {std::pair("metal", metal(0.3f)), std::pair("rough metal", metal(0.7f)), std::pair("coated varnish", coated),
        std::pair("glass", glass(0.2f)), std::pair("half of glass", half),
        std::pair("lobe", lobed({-1, -0.8f, 1}, 40.0f, 0.8f))}) {
    const ObjectMesh ball = sphere({0.5f, 0.5f, 0.5f}, 0.25f, material);
    SkyModel model = uniform_sky(1.0f, 0.3f);
    model.sun = SunDisc{};
    model.sun->direction = glm::normalize(glm::dvec3(0.1, -1.0, 0.7));
    model.sun->normal_irradiance = Rgb(5.0f);
    const SkyLight sky(model);
    const TraceScene listed = scene_of(coloured_cube(), kOpenFace, sky, ball),
                     unlisted = scene_of(coloured_cube(), {}, sky, ball);
    for (const glm::vec3 d : {glm::vec3(0, 1, 0.1f), glm::vec3(0.2f, 1, -0.2f)}) {
      const Mean a = radiance(listed, {0.5, 0.05, 0.5}, d, 1u << 14, 1),
                 b = radiance(unlisted, {0.5, 0.05, 0.5}, d, 1u << 14, 2);
      for (int k = 0; k < 3; ++k)
        EXPECT_NEAR(a.value[k], b.value[k], 0.002 * b.value[k] + 4.0 * (a.standard_error[k] + b.standard_error[k]))
            << name;
    }
  }
}

SkyModel sun_from(const glm::dvec3& direction) {
  SkyModel sky = uniform_sky(0.0f, 0.0f);
  sky.sun = SunDisc{};
  sky.sun->direction = glm::normalize(direction);
  sky.sun->normal_irradiance = Rgb(1.0f);
  return sky;
}

// All of the sun's light leaves a white mirror: radiance over a cone around the disc's image, times its solid angle. Of
// GGX with slope a, less than (2 a / cone)^2 lies outside.
TEST(Glossy, mirrors_and_polished_metals_send_all_of_the_sun) {
  for (const auto& [roughness, cone] : {std::pair(0.0f, 0.05f), std::pair(0.1f, 0.2f)}) {
    const TraceScene scene = scene_of(no_room(), {}, SkyLight(sun_from({0, 0.6, 0.8})),
                                      box({-20, -20, -0.1f}, {20, 20, 0.0f}, metal(roughness)));
    const Mean m = radiance(scene, {0, -0.6 * 3, 0.8 * 3}, {0, 0.6f, -0.8f}, 1u << 16, 7, cone);
    const double size = std::numbers::pi * static_cast<double>(cone * cone);
    EXPECT_NEAR(m.value.x * size, 1.0, 0.015 + 4.0 * m.standard_error.x * size) << roughness;
    EXPECT_LT(m.standard_error.x * size, 0.02) << roughness;
  }
}

TEST(Glossy, the_sun_goes_straight_through_glass_to_diffuse_surfaces) {
  ObjectMaterial m = glass(0.0f);
  m.attenuation_colour = {0.5f, 1.0f, 0.25f};
  m.attenuation_distance_m = 0.2f;
  const glm::dvec3 to_sun(0, 0.6, 0.8);
  const TraceScene scene =
      scene_of(no_room(), {}, SkyLight(sun_from(to_sun)), box({-20, -20, -0.1f}, {20, 20, 0.1f}, m));
  const PathTracer tracer(scene);
  glm::dvec3 sum(0.0);
  for (std::uint32_t n = 0; n < 256; ++n)
    sum += glm::dvec3(tracer.direct_irradiance(scene.to_local({0, 0, -1}), {0, 0, 1}, SampleStream(3, n), true).value) /
           256.0;
  const double face = 1.0 - static_cast<double>(fresnel_dielectric(0.8f, 1.5f));
  for (int k = 0; k < 3; ++k)
    EXPECT_NEAR(sum[k], 0.8 * face * face * std::pow(static_cast<double>(m.attenuation_colour[k]), 1.0 / 0.8), 2e-3);
}

// A ball of radiance L and radius r at distance d: E = pi L (r / d)^2.
TEST(Glossy, an_object_that_sends_light_lights_what_is_around_it) {
  ObjectMaterial lamp = varnish(1.0f);
  lamp.base_colour = Rgb(0.0f);
  lamp.emission = {3.0f, 2.0f, 1.0f};
  const TraceScene scene = scene_of(no_room(), {}, SkyLight(uniform_sky(0.0f, 0.0f)), sphere({0, 0, 2}, 0.5f, lamp));
  const PathTracer tracer(scene);
  glm::dvec3 sum(0.0);
  constexpr std::uint32_t kCount = 1u << 14;
  for (std::uint32_t n = 0; n < kCount; ++n)
    sum += glm::dvec3(tracer.indirect_irradiance(scene.to_local({0, 0, 0}), {0, 0, 1}, SampleStream(3, n), true).value);
  for (int k = 0; k < 3; ++k)
    EXPECT_NEAR(sum[k] / kCount, std::numbers::pi * static_cast<double>(lamp.emission[k]) / 16.0,
                0.02 * static_cast<double>(lamp.emission[k]));
}

// A black floor that mirrors R shows a lamp with Fresnel's factor of the index that belongs to R.
TEST(Glossy, a_room_surface_declared_to_mirror_shows_the_object) {
  Room room;
  room.vertices = {{-5, -5, 0}, {5, -5, 0}, {5, 5, 0}, {-5, 5, 0}};
  room.materials = {{"floor", Rgb(0.0f), Rgb(1.0f), false}};
  room.triangles = {{{0, 1, 2}, 0}, {{0, 2, 3}, 0}};
  ObjectMaterial lamp = varnish(1.0f);
  lamp.base_colour = Rgb(0.0f);
  lamp.emission = Rgb(1.0f);
  TraceScene scene = scene_of(room, {}, SkyLight(uniform_sky(0.0f, 0.0f)), box({-1, 1.9f, 0}, {1, 2, 2}, lamp));
  EXPECT_EQ(radiance(scene, {0, 0, 1}, {0, 1, -1}, 64).value.x, 0.0);
  ASSERT_TRUE(scene.declare_glossy(room, {{"floor", 0.1}}));
  const double n = (1.0 + std::sqrt(0.1)) / (1.0 - std::sqrt(0.1));
  const auto f = static_cast<double>(fresnel_dielectric(std::sqrt(0.5f), static_cast<float>(n)));
  const Mean m = radiance(scene, {0, 0, 1}, {0, 1, -1}, 4096);
  EXPECT_NEAR(m.value.x, f, 0.01 * f + 4.0 * m.standard_error.x);
}

TEST(Glossy, every_path_brings_a_finite_radiance) {
  ObjectMaterial prism = glass(0.0f, 1.7f);
  prism.dispersion = 1.0f;
  for (const ObjectMaterial& material : {metal(0.0f), metal(0.3f), varnish(0.1f), glass(0.4f), prism}) {
    const TraceScene scene = scene_of(coloured_cube(), kOpenFace, SkyLight(sun_from({0.1, -1.0, 0.7})),
                                      sphere({0.5f, 0.5f, 0.3f}, 0.25f, material));
    const PathTracer tracer(scene);
    for (std::uint32_t n = 0; n < 20000; ++n) {
      const SampleStream stream(5, n);
      const glm::vec2 u = stream.point(100);
      const Rgb value = tracer
                            .radiance(scene.to_local({0.5, 0.05, 0.9}),
                                      glm::normalize(glm::vec3(u.x - 0.5f, 0.8f, u.y - 1.1f)), stream, true)
                            .value;
      ASSERT_TRUE(std::isfinite(value.r + value.g + value.b)) << n;
    }
  }
}

// The same look, once as a plainly diffuse surface and once, by the least emission, as one with a BSDF.
TEST(Glossy, a_diffuse_surface_is_the_same_with_and_without_a_bsdf) {
  SkyModel sky = uniform_sky(1.0f, 0.3f);
  sky.sun = SunDisc{};
  sky.sun->direction = glm::normalize(glm::dvec3(0.1, -1.0, 0.7));
  sky.sun->normal_irradiance = Rgb(20.0f);
  ObjectMaterial plain;
  plain.base_colour = {0.7f, 0.5f, 0.3f};
  ObjectMaterial other = plain;
  other.emission = Rgb(1e-9f);
  const TraceScene a = scene_of(coloured_cube(), kOpenFace, SkyLight(sky), sphere({0.5f, 0.5f, 0.3f}, 0.2f, plain)),
                   b = scene_of(coloured_cube(), kOpenFace, SkyLight(sky), sphere({0.5f, 0.5f, 0.3f}, 0.2f, other));
  for (const glm::vec3 aim : {glm::vec3(0.5f, 0.4f, 0.45f), glm::vec3(0.6f, 0.4f, 0.2f), glm::vec3(0.3f, 0.8f, 0.0f)}) {
    const glm::dvec3 from(0.5, 0.05, 0.9);
    const Mean x = radiance(a, from, aim - glm::vec3(from), 1u << 14, 1),
               y = radiance(b, from, aim - glm::vec3(from), 1u << 14, 2);
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(x.value[k], y.value[k], 0.003 * x.value[k] + 4.0 * (x.standard_error[k] + y.standard_error[k]));
  }
}

} // namespace
} // namespace daylit
