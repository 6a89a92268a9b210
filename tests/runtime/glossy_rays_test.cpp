// What reflected and refracted rays find, against closed forms: in a room that is equally bright everywhere an object
// that absorbs nothing is as bright as the room, whatever it is made of.

#include <array>
#include <cmath>
#include <optional>
#include <span>

#include <gtest/gtest.h>

#include "runtime/reflect/glossy_rays.h"
#include "runtime/reflect/room_mirror.h"
#include "scene/material/fresnel.h"
#include "surrounded.h"

namespace daylit {
namespace {

using test::Surrounded;

constexpr auto kRoom = static_cast<float>(Surrounded::kRadiance);

ObjectMaterial metal(float roughness) {
  ObjectMaterial m;
  m.base_colour = Rgb(1.0f);
  m.metallic = 1.0f;
  m.roughness = roughness;
  return m;
}

ObjectMaterial glass() {
  ObjectMaterial m;
  m.base_colour = Rgb(1.0f);
  m.roughness = 0.0f;
  m.transmission = 1.0f;
  return m;
}

/// A sphere of a material in the middle of the white room.
struct GlossyScene {
  static constexpr float kRadius = 0.15f;
  const glm::dvec3 middle{2.0, 2.5, 1.2};
  Surrounded room{kRadius};
  VirtualObjects objects;
  std::optional<ObjectRays> rays;
  ApertureCrossings windows{std::vector<Aperture>{}};
  std::optional<DetectedSun> sun;
  std::optional<RoomSeen> seen;
  std::vector<TwoSided> sent;
  std::optional<GlossyRays> glossy;

  explicit GlossyScene(const ObjectMaterial& material, const GlossySettings& settings = {}) {
    room.mesh.materials = {material};
    glm::dmat4 world(1.0);
    world[3] = glm::dvec4(middle, 1.0);
    objects.surface = test::place(room.mesh, middle);
    objects.surface.reflectance.assign(room.mesh.positions.size(), Rgb(1.0f));
    VirtualObjects::Part part;
    part.model = std::make_shared<const VirtualObjects::Model>(
        VirtualObjects::Model{room.mesh, {}, Surrounded::rays_of(room.mesh)});
    part.world_from_object = world;
    part.per_pixel = true;
    objects.parts.push_back(std::move(part));
    objects.find_bounds(0);
    rays.emplace(objects);
    seen.emplace(
        RoomSeen{room.volume.room, room.rays, room.room_light, nullptr, room.pyramid, sun, windows, *rays, nullptr});
    sent.assign(room.mesh.positions.size(), {Rgb(Surrounded::kRadiance), Rgb(Surrounded::kRadiance)});
    glossy.emplace(*seen, sent, settings);
  }
  /// Radiance towards a viewer who looks past the middle at this distance.
  Rgb radiance(double aside) const {
    const WorldRay ray{middle + glm::dvec3(-1.0, aside, 0.0), glm::vec3(1.0f, 0.0f, 0.0f)};
    const auto point = rays->closest(ray, 10.0);
    std::array<glm::vec2, 64> places;
    for (std::size_t k = 0; k < places.size(); ++k) { // Hammersley
      std::size_t mirrored = 0;
      for (std::size_t bit = 0; bit < 6; ++bit)
        mirrored |= (k >> bit & 1u) << (5 - bit);
      places[k] = (glm::vec2(k, mirrored) + 0.5f) / 64.0f;
    }
    const CameraPoint camera_point{ray, *point, places, 0.0};
    GlossyLight light;
    glossy->look({&camera_point, 1}, {&light, 1});
    return light.radiance + light.diffuse * kRoom;
  }
};

void expect_as_bright_as_the_room(const ObjectMaterial& material, double tolerance, const char* name) {
  const GlossyScene scene(material);
  for (const double aside : {0.01, 0.07, 0.13})
    EXPECT_NEAR(static_cast<double>(scene.radiance(aside).g) / Surrounded::kRadiance, 1.0, tolerance)
        << name << ", " << aside << " m from the middle";
}

TEST(GlossyRays, a_white_metal_in_an_even_room_is_as_bright_as_the_room) {
  for (const float roughness : {0.0f, 0.1f, 0.3f, 0.6f})
    expect_as_bright_as_the_room(metal(roughness), 0.01, "metal");
}

TEST(GlossyRays, a_white_plastic_in_an_even_room_is_as_bright_as_the_room) {
  ObjectMaterial plastic;
  plastic.base_colour = Rgb(1.0f);
  plastic.roughness = 0.3f;
  expect_as_bright_as_the_room(plastic, 0.015, "plastic");
  plastic.clearcoat = 1.0f;
  plastic.clearcoat_roughness = 0.1f;
  expect_as_bright_as_the_room(plastic, 0.02, "coated plastic");
}

TEST(GlossyRays, clear_glass_in_an_even_room_is_as_bright_as_the_room) {
  expect_as_bright_as_the_room(glass(), 0.02, "glass");
}

TEST(GlossyRays, absorbing_glass_keeps_what_beers_law_says) {
  // Straight through the middle: T^2 exp(-a d) / (1 - (F exp(-a d))^2) of the room behind, and what is mirrored.
  ObjectMaterial green = glass();
  green.attenuation_colour = Rgb(0.5f, 0.9f, 0.7f);
  green.attenuation_distance_m = 0.2f;
  const GlossyScene scene(green);
  const Rgb found = scene.radiance(1e-4) / kRoom;
  const double f = 0.04, d = 2.0 * static_cast<double>(GlossyScene::kRadius);
  for (int c = 0; c < 3; ++c) {
    const double left = std::pow(static_cast<double>(green.attenuation_colour[c]), d / 0.2);
    const double through = (1.0 - f) * (1.0 - f) * left / (1.0 - f * f * left * left);
    const double back = f + (1.0 - f) * (1.0 - f) * f * left * left / (1.0 - f * f * left * left);
    EXPECT_NEAR(static_cast<double>(found[c]), through + back, 0.01) << c;
  }
}

TEST(GlossyRays, light_goes_straight_through_glass_by_fresnel_and_beer) {
  ObjectMaterial green = glass();
  green.attenuation_colour = Rgb(0.5f, 0.9f, 0.7f);
  green.attenuation_distance_m = 0.2f;
  const GlossyScene scene(green);
  const double aside = 0.09, d = 2.0 * std::sqrt(0.15 * 0.15 - aside * aside), cosine = 0.5 * d / 0.15;
  const double f = static_cast<double>(fresnel_dielectric(static_cast<float>(cosine), 1.5f)); // straight: at both faces
  const Rgb rest = scene.rays->transmittance({scene.middle + glm::dvec3(-1.0, aside, 0.0), {1.0f, 0.0f, 0.0f}}, 2.0);
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(static_cast<double>(rest[c]),
                (1.0 - f) * (1.0 - f) * std::pow(static_cast<double>(green.attenuation_colour[c]), d / 0.2), 0.01);
}

TEST(ObjectRays, glass_is_as_clear_behind_another_object_as_alone) {
  GlossyScene scene(glass());
  const float alone = scene.rays->opacity(0);
  // Normal incidence on both faces loses 0.08; the rim loses all. The mean over the sphere's disc lies between.
  EXPECT_GT(alone, 0.08f);
  EXPECT_LT(alone, 0.3f);
  VirtualObjects::Part opaque = scene.objects.parts[0];
  VirtualObjects::Model model = *opaque.model;
  model.mesh.materials = {metal(0.3f)};
  opaque.model = std::make_shared<const VirtualObjects::Model>(std::move(model));
  opaque.first_vertex = scene.objects.surface.positions.size();
  opaque.world_from_object[3].y += 0.4;
  for (const glm::vec3& p : opaque.mesh().positions)
    scene.objects.surface.positions.push_back(scene.middle + glm::dvec3(0.0, 0.4, 0.0) + glm::dvec3(p));
  scene.objects.parts.push_back(std::move(opaque));
  scene.objects.find_bounds(1);
  EXPECT_EQ(ObjectRays(scene.objects).opacity(0), alone);
}

TEST(GlossyRays, a_photograph_one_pixel_wide_shows_nothing) {
  Composite composite;
  composite.picture = RgbImage(1, 1);
  composite.coverage = {0.0f};
  LensModel lens;
  lens.fx = lens.fy = 1.0;
  const auto camera = make_render_camera(lens, glm::dmat4(1.0), 1, 1);
  ASSERT_TRUE(camera);
  const PhotoScale scale;
  EXPECT_FALSE(PhotographedRoom(composite, *camera, lens, scale, 1.0f).radiance({0.0, 0.0, 1.0}));
}

TEST(GlossyRays, a_mirror_shows_what_the_mirrored_ray_meets) {
  GlossyScene scene(metal(0.0f));
  for (std::size_t t = 0; t < scene.room.volume.room.materials.size(); ++t)
    scene.room.volume.room.materials[t].reflectance = Rgb(0.2f);
  const Rgb dim = scene.radiance(0.05);
  EXPECT_NEAR(static_cast<double>(dim.g), 0.2 * Surrounded::kRadiance, 0.01);
}

TEST(GlossyRays, fewer_rays_than_the_glass_needs_lose_light_and_never_add_any) {
  for (const int most : {1, 2, 4, 8}) {
    const GlossyScene scene(glass(), {.most_rays = most});
    EXPECT_LE(scene.radiance(0.07).g, 1.001f * kRoom) << most << " rays";
  }
}

TEST(RoomMirror, names_the_materials_of_the_room_when_one_is_not_there) {
  const Surrounded room(0.1f);
  const auto mirror = RoomMirror::make(room.volume.room, {{"carpet", 0.1}});
  ASSERT_FALSE(mirror);
  EXPECT_NE(mirror.error().message().find("carpet"), std::string::npos);
}

} // namespace
} // namespace daylit
