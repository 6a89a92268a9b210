// What a normal map and a dielectric do to the diffuse part of a material, against the cosines of single lights.

#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "glossy_scene.h"
#include "scene/material/bsdf.h"
#include "scene/volume/volume.h"

namespace daylit {
namespace {

using test::GlossyScene;

constexpr float kAlbedo = 0.5f;
/// The same everywhere: tilts the normal up.
constexpr std::array<std::uint8_t, 3> kTexel{128, 204, 230};

ObjectMaterial diffuse(bool mapped) {
  ObjectMaterial m;
  m.base_colour = Rgb(kAlbedo);
  m.roughness = 1.0f;
  if (mapped)
    m.normal_texture.texture = 0;
  return m;
}

/// A diffuse sphere seen along x in its middle, where its smooth normal is -x and the mapped one leans towards z.
struct MappedSphere : GlossyScene {
  std::vector<Sh9Rgb> arriving;
  static constexpr glm::vec3 kSmooth{-1.0f, 0.0f, 0.0f};

  explicit MappedSphere(bool mapped = true) : MappedSphere(diffuse(mapped)) {}
  explicit MappedSphere(const ObjectMaterial& material) : GlossyScene(diffuse(false), {}, test::box_window()) {
    ObjectMesh mesh = room.mesh;
    mesh.materials = {material};
    mesh.uv.assign(mesh.positions.size(), glm::vec2(0.5f));
    mesh.textures = {*Texture::make({1, 1, {kTexel[0], kTexel[1], kTexel[2]}}, TextureCoding::linear)};
    objects.parts[0].model =
        std::make_shared<const VirtualObjects::Model>(VirtualObjects::Model{mesh, {}, test::Surrounded::rays_of(mesh)});
    renew();
  }
  static glm::vec3 mapped_normal() {
    const glm::vec3 d = 2.0f * glm::vec3(kTexel[0], kTexel[1], kTexel[2]) / 255.0f - 1.0f;
    return glm::normalize(d.y * glm::vec3(0.0f, 0.0f, 1.0f) + d.z * kSmooth + d.x * glm::vec3(0.0f, -1.0f, 0.0f));
  }
  GlossyLight shown(const std::vector<DirectionalLight>& sky) {
    glossy.emplace(*seen, sent, indirect, sky, GlossySettings{}, arriving);
    return look(0.0002);
  }
};

const DirectionalLight kFront{glm::normalize(glm::dvec3(-1.0, 0.2, 0.8)), Rgb(2.0f)};

float cosine(const glm::vec3& n, const DirectionalLight& l) { return glm::dot(n, glm::vec3(l.direction)); }

TEST(Relief, direct_light_goes_with_the_cosine_of_the_mapped_normal) {
  MappedSphere sphere;
  const float expected = cosine(MappedSphere::mapped_normal(), kFront) / cosine(MappedSphere::kSmooth, kFront);
  ASSERT_GT(expected, 1.2f);
  EXPECT_NEAR(sphere.shown({kFront}).diffuse.g / kAlbedo, expected, 0.02f);
}

TEST(Relief, light_from_below_the_surface_reaches_no_tilted_normal) {
  MappedSphere sphere;
  const DirectionalLight below{glm::normalize(glm::dvec3(0.2, 0.0, 1.0)), Rgb(5.0f)};
  ASSERT_GT(cosine(MappedSphere::mapped_normal(), below), 0.3f);
  EXPECT_EQ(sphere.shown({kFront, below}).diffuse, sphere.shown({kFront}).diffuse);
}

TEST(Relief, the_sun_counts_beside_the_sky) {
  MappedSphere sphere;
  const DirectionalLight sun{glm::normalize(glm::dvec3(-0.3, 2.5, -0.2)), Rgb(50.0f)}; // through the window
  sphere.sun = DetectedSun{.direction = sun.direction, .normal_irradiance = sun.irradiance};
  float mapped = 0.0f, smooth = 0.0f;
  for (const DirectionalLight& l : {kFront, sun}) {
    mapped += l.irradiance.g * cosine(MappedSphere::mapped_normal(), l);
    smooth += l.irradiance.g * cosine(MappedSphere::kSmooth, l);
  }
  EXPECT_NEAR(sphere.shown({kFront}).diffuse.g / kAlbedo, mapped / smooth, 0.02f);
}

/// Diffuse radiance of even light: albedo (1 + m.n) / 2 of it, for the rest of what m faces is the object.
/// A gradient along z: E(m) / E(n) more.
TEST(Relief, indirect_light_is_that_of_the_mapped_normal_above_the_surface) {
  MappedSphere sphere;
  Sh9Rgb light{};
  light[0] = Rgb(1.0f);
  const glm::vec3 m = MappedSphere::mapped_normal(), n = MappedSphere::kSmooth;
  for (const float gradient : {0.0f, 0.3f}) {
    light[2] = Rgb(gradient);
    sphere.arriving.assign(sphere.room.mesh.positions.size(), light);
    const float relief = 0.5f * (1.0f + glm::dot(m, n)) * irradiance(light, m).g / irradiance(light, n).g;
    const GlossyLight shown = sphere.shown({});
    const float left = shown.diffuse.g * GlossyScene::kIndirect - shown.occluded.g;
    EXPECT_NEAR(left / (kAlbedo * GlossyScene::kIndirect), relief, 0.01f) << gradient;
  }
}

TEST(Relief, without_a_normal_map_nothing_changes) {
  MappedSphere sphere(false);
  sphere.arriving.assign(sphere.room.mesh.positions.size(), Sh9Rgb{Rgb(1.0f), Rgb(0.3f), Rgb(0.2f)});
  const GlossyLight light = sphere.shown({kFront});
  EXPECT_EQ(light.diffuse, Rgb(kAlbedo));
  EXPECT_EQ(light.occluded, Rgb(0.0f));
}

TEST(Relief, under_a_dielectric_the_base_takes_of_each_light_what_its_angle_lets_in_and_all_of_the_indirect) {
  ObjectMaterial plastic = diffuse(false);
  plastic.roughness = 0.3f;
  MappedSphere sphere(plastic);
  SurfaceMaterial m;
  m.base_colour = Rgb(kAlbedo);
  m.alpha_u = m.alpha_v = 0.09f;
  const Bsdf bsdf(m);
  const float albedo = bsdf.diffuse_albedo({0.0f, 0.0f, 1.0f}).g;
  for (const double angle : {0.2, 0.9, 1.4}) {
    const DirectionalLight light{{-std::cos(angle), 0.0, std::sin(angle)}, Rgb(2.0f)};
    const float share = bsdf.base_share(glm::vec3(std::sin(angle), 0.0f, std::cos(angle)));
    EXPECT_GT(std::fabs(share - 1.0f), 0.02f);
    const GlossyLight shown = sphere.shown({light});
    EXPECT_NEAR(shown.diffuse.g / albedo, share, 0.01f) << angle;
    EXPECT_NEAR(shown.diffuse.g * GlossyScene::kIndirect - shown.occluded.g, albedo * GlossyScene::kIndirect, 1e-4f);
  }
}

} // namespace
} // namespace daylit
