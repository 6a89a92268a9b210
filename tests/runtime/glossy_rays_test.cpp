// What reflected and refracted rays find, against closed forms: in a room that is equally bright everywhere an object
// that absorbs nothing is as bright as the room, whatever it is made of.

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <span>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "glossy_scene.h"
#include "runtime/reflect/glossy_rays.h"
#include "runtime/reflect/room_mirror.h"
#include "scene/core/orthonormal.h"
#include "scene/material/fresnel.h"

namespace daylit {
namespace {

using test::glass;
using test::GlossyScene;
using test::kRoom;
using test::metal;
using test::Surrounded;

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

TEST(GlossyRays, a_narrow_coat_over_a_rough_base_is_kept_apart_and_mirrors_as_fresnel_says) {
  ObjectMaterial m;
  m.base_colour = Rgb(1.0f);
  m.roughness = 0.6f;
  m.clearcoat = 1.0f;
  m.clearcoat_roughness = 0.02f;
  expect_as_bright_as_the_room(m, 0.02, "coated");
  const GlossyScene scene(m);
  for (const double aside : {0.01, 0.07, 0.13}) {
    const double r = static_cast<double>(GlossyScene::kRadius), cosine = std::sqrt(1.0 - aside * aside / (r * r));
    const float fresnel = fresnel_dielectric(static_cast<float>(cosine), 1.5f);
    EXPECT_NEAR(scene.look(aside).coat.g, fresnel * kRoom, 0.02f * kRoom) << aside;
  }
  m.clearcoat_roughness = 0.6f;
  EXPECT_EQ(GlossyScene(m).look(0.07).coat, Rgb(0.0f)) << "a wide coat is shared as the base is";
}

TEST(GlossyRays, clear_glass_in_an_even_room_is_as_bright_as_the_room) {
  expect_as_bright_as_the_room(glass(), 0.02, "glass");
}

TEST(GlossyRays, a_lobe_in_an_even_room_sends_what_its_weight_and_the_cosine_say) {
  ObjectMaterial m;
  m.base_colour = Rgb(0.5f);
  m.lobe = LafortuneLobe{Rgb(0.3f), {-1.0f, -1.0f, 1.0f}, 200.0f};
  const GlossyScene scene(m);
  for (const double aside : {0.01, 0.07, 0.12}) {
    const double r = static_cast<double>(GlossyScene::kRadius), cosine = std::sqrt(1.0 - aside * aside / (r * r));
    EXPECT_NEAR(static_cast<double>(scene.radiance(aside).g / kRoom), 0.5 + 0.3 * cosine, 0.01) << aside;
  }
  m.lobe->grazing = 1.0f;
  const GlossyScene rising(m);
  for (const double aside : {0.01, 0.07, 0.13, 0.1499}) {
    EXPECT_LE(rising.radiance(aside).g, 1.005f * kRoom) << aside;
    EXPECT_GE(rising.radiance(aside).g, scene.radiance(aside).g - 0.01f * kRoom) << aside;
  }
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
  const float alone = scene.rays->mean_transmittance(0).g;
  // Normal incidence on both faces loses 0.08; the rim loses all. The mean over the sphere's disc lies between.
  EXPECT_LT(alone, 0.92f);
  EXPECT_GT(alone, 0.7f);
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
  EXPECT_EQ(ObjectRays(scene.objects).mean_transmittance(0).g, alone);
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

TEST(GlossyRays, branches_that_are_not_followed_are_as_bright_as_the_rooms_light_on_the_surface) {
  GlossyScene scene(glass());
  scene.indirect.assign(scene.indirect.size(), {Rgb(kRoom), Rgb(kRoom)});
  scene.renew({.most_depth = 8, .least_importance = 0.03f});
  for (const double aside : {0.01, 0.07, 0.11})
    EXPECT_NEAR(scene.radiance(aside).g, Surrounded::kRadiance, 0.002 * Surrounded::kRadiance) << aside;
}

TEST(GlossyRays, glass_behind_glass_mirrors_at_each_of_its_faces) {
  // Face on, F = 0.04. First ball: mirrored, passed; at its back passed and mirrored, which comes out alone: 5 rays.
  // Second: in front both, the mirrored one goes through the first ball; at its back both, since 0.96^3 x 0.04 is just
  // above 0.035, and what is mirrored there goes back through both balls.
  GlossyScene scene(glass());
  scene.indirect.assign(scene.indirect.size(), {Rgb(kRoom), Rgb(kRoom)});
  scene.renew();
  EXPECT_EQ(scene.rays_followed(1e-4), 5u);
  scene.add(glass(), scene.middle + glm::dvec3(0.4, 0.0, 0.0));
  EXPECT_EQ(scene.rays_followed(1e-4), 14u);
  EXPECT_NEAR(scene.radiance(1e-4).g, Surrounded::kRadiance, 0.002 * Surrounded::kRadiance);
}

TEST(GlossyRays, a_mirror_image_on_the_outside_is_followed_however_faint_for_a_window_is_bright) {
  // Index 1.2: F = (0.2 / 2.2)^2 = 0.0083. Mirrored, passed; at the back passed alone.
  ObjectMaterial weak = glass();
  weak.ior = 1.2f;
  EXPECT_EQ(GlossyScene(weak).rays_followed(1e-4), 3u);
}

/// A wide photograph from the middle of the room's south, all of one radiance, and what the room's model says.
struct Photographed {
  static constexpr int kSide = 64;
  static constexpr float kShown = 5.0f;
  GlossyScene scene{metal(0.0f)};
  Composite composite;
  LensModel lens = ideal_pinhole(kSide, kSide, 1.6);
  RenderCamera camera = test::look_at({2.0, 0.4, 1.2}, {2.0, 5.0, 1.2}, kSide, kSide, 1.6);
  PhotoScale scale;

  Photographed() {
    composite.picture = RgbImage(kSide, kSide, Rgb(kShown));
    composite.coverage.assign(static_cast<std::size_t>(kSide) * kSide, 0.0f);
  }
  /// What is seen of the room from its middle.
  double seen_towards(const glm::vec3& direction, const PhotoPixels* photo = nullptr) {
    const PhotographedRoom photograph(composite, camera, lens, scale, 100.0f, photo);
    const RoomSeen& plain = *scene.seen;
    const RayScene rays = *RayScene::build(scene.room.volume.room);
    const RoomSeen seen{plain.room, rays,          plain.light,   plain.shadow, plain.pyramid,
                        plain.sun,  plain.windows, plain.objects, &photograph,  nullptr};
    std::array<RoomRay, 1> ray{RoomRay{{scene.middle, direction}, 100.0, 0.0f, std::nullopt, Rgb(0.0f)}};
    seen.find_ends(ray);
    seen.find_radiance(ray);
    return static_cast<double>(ray[0].radiance.g);
  }
};

TEST(RoomSeen, a_ray_shows_the_photograph_only_where_the_camera_sees_its_end) {
  const glm::vec3 north(0.0f, 1.0f, 0.0f), south(0.0f, -1.0f, 0.0f);
  Photographed plain;
  EXPECT_NEAR(plain.seen_towards(north), Photographed::kShown, 1e-4);
  EXPECT_NEAR(plain.seen_towards(south), Surrounded::kRadiance, 0.01) << "behind the camera";
  Photographed white;
  white.composite.picture = RgbImage(Photographed::kSide, Photographed::kSide, Rgb(200.0f));
  EXPECT_NEAR(white.seen_towards(north), Surrounded::kRadiance, 0.01) << "the photograph is white there";
  Photographed screened;
  test::add_block(screened.scene.room.volume.room, {1.5, 0.8, 0.7}, {2.5, 0.9, 1.7}, 0);
  EXPECT_NEAR(screened.seen_towards(north), Surrounded::kRadiance, 0.01) << "a screen stands between";
}

TEST(RoomSeen, behind_an_object_a_ray_shows_the_photograph_as_it_was_without_it) {
  const glm::vec3 north(0.0f, 1.0f, 0.0f);
  Photographed covered;
  const RgbImage poster(Photographed::kSide, Photographed::kSide, Rgb(3.0f));
  const PhotoPixels photo(poster);
  covered.composite.coverage.assign(covered.composite.coverage.size(), 1.0f);
  EXPECT_NEAR(covered.seen_towards(north, &photo), 3.0, 1e-4);
  EXPECT_NEAR(covered.seen_towards(north), Surrounded::kRadiance, 0.01) << "without a photograph of it";
  test::add_block(covered.scene.room.volume.room, {1.5, 0.8, 0.7}, {2.5, 0.9, 1.7}, 0);
  EXPECT_NEAR(covered.seen_towards(north, &photo), Surrounded::kRadiance, 0.01) << "a screen stands between";
}

TEST(RoomSeen, the_last_ray_of_a_sample_finds_the_room_below_an_object_lit) {
  GlossyScene scene(metal(0.0f));
  const glm::dvec3 standing(2.0, 2.5, static_cast<double>(GlossyScene::kRadius));
  scene.room.place(standing, 0.0f);
  const RoomSeen& plain = *scene.seen;
  const RoomSeen seen{plain.room,    plain.rays,    plain.light, &scene.room.change, plain.pyramid, plain.sun,
                      plain.windows, plain.objects, nullptr};
  const WorldRay down{{2.01, 2.5, 0.05}, {0.0f, 0.0f, -1.0f}};
  std::array<RoomRay, 2> rays;
  rays[0].ray = rays[1].ray = down;
  rays[1].past_objects = true;
  seen.find_ends(rays);
  seen.find_radiance(rays);
  EXPECT_LT(rays[0].radiance.g, 0.3f * kRoom);
  EXPECT_NEAR(rays[1].radiance.g, kRoom, 0.02f * kRoom);
}

TEST(RoomSeen, the_last_ray_of_a_sample_finds_no_sky_that_the_room_hides) {
  GlossyScene scene(metal(0.0f), {}, test::box_window(), 30.0f);
  Surrounded& s = scene.room;
  test::add_block(s.volume.room, {0.01, 3.4, 0.01}, {3.99, 3.5, 2.2}, 0); // a screen before the window
  s.rays = *RayScene::build(s.volume.room);
  s.room_light = RoomLight(s.volume.room, s.rays, s.sampler);
  s.room_light.set_frame(s.field, s.pyramid, s.cells, {});
  s.change = IndirectShadow(s.volume.room, s.rays, test::box_window(), s.room_light);
  s.place(scene.middle, 0.0f);
  const RoomSeen& plain = *scene.seen;
  const RoomSeen seen{plain.room, plain.rays,    plain.light,   &s.change, plain.pyramid,
                      plain.sun,  plain.windows, plain.objects, nullptr};
  std::array<RoomRay, 1> ray;
  ray[0].ray = {{2.0, 1.5, 0.05}, {0.0f, 0.0f, -1.0f}};
  ray[0].past_objects = true;
  seen.find_ends(ray);
  ASSERT_TRUE(ray[0].end);
  seen.find_radiance(ray);
  EXPECT_GT(s.room_light.evaluate(ray[0].end->triangle, {2.0, 1.5, 0.0}, {0, 0, -1}).open_sky_irradiance.g,
            0.3f * kRoom);
  EXPECT_NEAR(ray[0].radiance.g, kRoom, 0.02f * kRoom);
}

TEST(GlossyRays, an_occlusion_texture_takes_indirect_light_of_the_diffuse_part_only) {
  for (const bool glossy : {false, true}) {
    ObjectMaterial m;
    m.base_colour = Rgb(0.6f);
    m.roughness = glossy ? 0.3f : 1.0f;
    m.occlusion_texture.texture = 0;
    m.occlusion_strength = 0.5f;
    GlossyScene scene(m);
    const GlossyLight open = scene.look(0.05);
    EXPECT_EQ(open.occluded, Rgb(0.0f)) << "no texture coordinates yet";
    VirtualObjects::Model model = *scene.objects.parts[0].model;
    model.mesh.uv.assign(model.mesh.positions.size(), glm::vec2(0.5f));
    model.mesh.textures = {*Texture::make({1, 1, {51, 51, 51}}, TextureCoding::linear)};
    scene.objects.parts[0].model = std::make_shared<const VirtualObjects::Model>(std::move(model));
    const GlossyLight hollow = scene.look(0.05);
    // Vertices of reflectance 1: their indirect radiance times that of the base here, half of 1 - 0.2 gone.
    EXPECT_NEAR(hollow.occluded.g, 0.4f * GlossyScene::kIndirect * open.diffuse.g, 1e-4f);
    EXPECT_EQ(hollow.radiance, open.radiance);
    EXPECT_EQ(hollow.diffuse, open.diffuse);
  }
}

TEST(GlossyRays, dispersion_draws_each_colour_with_its_own_index) {
  ObjectMaterial crystal = glass();
  crystal.ior = 1.6f;
  crystal.dispersion = 1.5f;
  const auto walls = [](GlossyScene& scene) { // some white, some black, so that directions can be told
    Room& room = scene.room.volume.room;
    room.materials.push_back({"black", Rgb(0.0f), Rgb(1.0f), false});
    for (std::size_t t = 0; t < room.triangles.size(); t += 2)
      room.triangles[t].material = static_cast<std::uint32_t>(room.materials.size() - 1);
  };
  GlossyScene scene(crystal);
  walls(scene);
  float apart = 0.0f;
  for (int c = 0; c < 3; ++c) {
    ObjectMaterial plain = glass();
    plain.ior = 1.6f + static_cast<float>(c - 1) * 0.025f * 1.5f * 0.6f;
    GlossyScene one(plain);
    walls(one);
    for (const double aside : {0.03, 0.06, 0.09, 0.11, 0.13, 0.14}) {
      EXPECT_NEAR(scene.radiance(aside)[c], one.radiance(aside)[c], 1e-5f) << c << ", " << aside;
      apart = std::max(apart, std::abs(scene.radiance(aside).r - scene.radiance(aside).b));
    }
  }
  EXPECT_GT(apart, 0.01f);
}

TEST(GlossyRays, metal_that_sees_itself_is_followed_beyond_the_eighth_ray_while_it_brings_a_tenth) {
  ObjectMaterial dark = metal(0.0f);
  dark.base_colour = Rgb(0.7f); // 0.7^7 = 0.08
  for (const auto& [material, more, rays] : {std::tuple(metal(0.0f), 4, 12u), {metal(0.0f), 0, 8u}, {dark, 4, 8u}}) {
    GlossyScene scene(material);
    scene.add(material, scene.middle + glm::dvec3(0.0, 0.302, 0.0)); // a gap of 2 mm
    scene.renew({.most_more = more});
    EXPECT_EQ(scene.rays_followed(0.1465), rays) << more;
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
