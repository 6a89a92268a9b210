// Things with walls of glass, whose rays meet many faces: in a room that is equally bright everywhere they are as
// bright as the room, and what they show of a window or the sun does not depend on how it is looked for.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include <glm/trigonometric.hpp>
#include <gtest/gtest.h>

#include "glossy_scene.h"
#include "scene/material/fresnel.h"

namespace daylit {
namespace {

using test::glass;
using test::GlossyScene;
using test::kRoom;
using test::metal;

/// The sphere becomes a hollow one, with a wall of a part of the radius. Its surface is lit as an even room lights it.
void hollow_out(GlossyScene& scene, float wall, const GlossySettings& settings = {}) {
  VirtualObjects::Model model{scene.room.mesh, {}, {}};
  const auto count = static_cast<std::uint32_t>(model.mesh.positions.size());
  for (std::uint32_t k = 0; k < count; ++k) {
    model.mesh.positions.push_back((1.0f - wall) * model.mesh.positions[k]);
    model.mesh.normals.push_back(-model.mesh.normals[k]);
  }
  for (std::size_t k = 0, triangles = model.mesh.triangles.size(); k < triangles; ++k) {
    const auto t = model.mesh.triangles[k];
    model.mesh.triangles.push_back({t[0] + count, t[2] + count, t[1] + count});
  }
  model.mesh.reflectance.resize(2 * static_cast<std::size_t>(count), Rgb(1.0f));
  model.rays = test::Surrounded::rays_of(model.mesh);
  scene.objects.parts[0].model = std::make_shared<const VirtualObjects::Model>(std::move(model));
  scene.objects.surface.reflectance.assign(2 * static_cast<std::size_t>(count), Rgb(1.0f));
  scene.indirect.assign(2 * static_cast<std::size_t>(count), {Rgb(kRoom), Rgb(kRoom)});
  scene.sent = scene.indirect;
  scene.renew(settings);
}

TEST(GlassWalls, a_hollow_sphere_in_an_even_room_is_as_bright_as_the_room_up_to_its_rim) {
  for (const float wall : {0.02f, 0.1f, 0.3f}) {
    GlossyScene scene(glass());
    hollow_out(scene, wall);
    for (int k = 0; k < 150; ++k)
      EXPECT_NEAR(scene.radiance(0.001 * k + 0.0003).g / kRoom, 1.0f, 0.005f)
          << wall << ", " << k << " mm from the middle";
  }
}

TEST(GlassWalls, however_few_rays_may_follow_one_another_no_light_is_lost_or_added) {
  for (const int most : {1, 2, 3, 5, 8}) {
    GlossyScene scene(glass(), {});
    hollow_out(scene, 0.1f, {.most_depth = most});
    for (const double aside : {0.01, 0.07, 0.12, 0.14})
      EXPECT_NEAR(scene.radiance(aside).g / kRoom, 1.0f, 0.005f) << most << " rays, " << aside;
  }
  GlossyScene none(glass());
  hollow_out(none, 0.1f, {.most_depth = 0});
  EXPECT_EQ(none.look(0.07).radiance, Rgb(0.0f));
}

TEST(GlassWalls, what_runs_on_inside_after_the_last_ray_is_as_bright_as_the_light_on_the_surface) {
  constexpr float kOnSurface = 0.3f;
  for (const float colour : {1.0f, 0.5f}) { // of each of two faces
    ObjectMaterial material = glass();
    material.base_colour = Rgb(colour);
    GlossyScene scene(material);
    scene.indirect.assign(scene.indirect.size(), {Rgb(kOnSurface), Rgb(kOnSurface)});
    scene.renew({.most_depth = 1});
    for (const double aside : {0.0, 0.06, 0.12}) {
      const double sine = aside / static_cast<double>(GlossyScene::kRadius);
      const float mirrored = fresnel_dielectric(static_cast<float>(std::sqrt(1.0 - sine * sine)), glass().ior);
      EXPECT_NEAR(scene.radiance(aside).g, mirrored * kRoom + (1.0f - mirrored) * colour * colour * kOnSurface, 0.02f)
          << aside << ", " << colour;
    }
  }
}

/// Light that is not followed is as bright as all light on the surface, the sky's too: rough glass lets it in from all
/// sides.
TEST(GlassWalls, a_frosted_hollow_sphere_in_an_even_room_loses_no_light_however_few_rays_follow_one_another) {
  ObjectMaterial frosted = glass();
  frosted.roughness = 0.4f;
  for (const int most : {1, 2, 4, 8}) {
    GlossyScene scene(frosted);
    hollow_out(scene, 0.1f);
    for (TwoSided& light : scene.indirect)
      light = {Rgb(0.5f * kRoom), Rgb(0.5f * kRoom)};
    scene.renew({.most_depth = most});
    for (const double aside : {0.01, 0.07, 0.12})
      EXPECT_NEAR(scene.radiance(aside).g / kRoom, 1.0f, 0.02f) << most << " rays, " << aside;
  }
}

/// A square rod, 0.6 m long and 2 cm thick, that lies 40 degrees across the viewer's direction, in place of the sphere.
void lay_rod(GlossyScene& scene) {
  VirtualObjects::Model model;
  model.mesh.materials = {glass()};
  const float angle = glm::radians(40.0f);
  const glm::mat3 turn{{std::cos(angle), std::sin(angle), 0.0f}, {-std::sin(angle), std::cos(angle), 0.0f}, {0, 0, 1}};
  const glm::vec3 half(0.3f, 0.01f, 0.01f);
  for (int axis = 0; axis < 3; ++axis)
    for (const float side : {-1.0f, 1.0f}) {
      const auto first = static_cast<std::uint32_t>(model.mesh.positions.size());
      glm::vec3 normal(0.0f), u(0.0f), v(0.0f);
      normal[axis] = side;
      u[(axis + 1) % 3] = side;
      v[(axis + 2) % 3] = 1.0f;
      for (const auto& [a, b] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
        model.mesh.positions.push_back(turn *
                                       (half * (normal + static_cast<float>(a) * u + static_cast<float>(b) * v)));
        model.mesh.normals.push_back(turn * normal);
      }
      model.mesh.triangles.push_back({first, first + 1, first + 2});
      model.mesh.triangles.push_back({first, first + 2, first + 3});
    }
  model.mesh.reflectance.assign(model.mesh.positions.size(), Rgb(1.0f));
  model.rays = test::Surrounded::rays_of(model.mesh);
  scene.objects.surface = test::place(model.mesh, scene.middle);
  scene.objects.parts[0].model = std::make_shared<const VirtualObjects::Model>(std::move(model));
  scene.objects.find_bounds(0);
}

/// The end of the rod shows the wall behind it, after fourteen total reflections between two of its sides.
TEST(GlassWalls, a_rod_leads_the_light_of_a_bright_wall_to_its_other_end) {
  constexpr float kDim = 0.2f;
  GlossyScene scene(glass());
  lay_rod(scene);
  Room& walls = scene.room.volume.room;
  scene.room.set_walls(kDim);
  walls.materials.push_back(walls.materials[0]);
  walls.materials.back().reflectance = Rgb(1.0f);
  const double behind = std::ranges::max(walls.vertices, {}, [](const glm::dvec3& v) { return v.x; }).x;
  for (RoomTriangle& t : walls.triangles)
    if (std::ranges::all_of(t.vertex, [&](std::uint32_t v) { return walls.vertices[v].x > behind - 1e-6; }))
      t.material = static_cast<std::uint32_t>(walls.materials.size() - 1);
  scene.indirect.assign(scene.objects.surface.positions.size(), {Rgb(kDim * kRoom), Rgb(kDim * kRoom)});
  scene.sent = scene.indirect;
  scene.renew();
  const float passes = 1.0f - fresnel_dielectric(std::cos(glm::radians(40.0f)), glass().ior);
  const float through = passes * passes;
  EXPECT_NEAR(scene.radiance(-0.193).g / kRoom, through + (1.0f - through) * kDim, 0.01f);
}

TEST(GlassWalls, rough_metal_is_looked_at_in_as_many_places_behind_clear_glass_as_by_itself) {
  GlossyScene scene(glass());
  scene.add(metal(0.4f), scene.middle + glm::dvec3(0.4, 0.0, 0.0));
  EXPECT_GE(scene.rays_followed(1e-4), std::size_t{1} << scene.place_bits);
}

/// Mean of a row of points across, each with the lobe samples and lights of sixteen pixels.
double mean_seen(const GlossyScene& scene) {
  double sum = 0.0;
  for (int i = 0; i < 60; ++i)
    for (int k = 0; k < 16; ++k)
      sum += static_cast<double>(scene.look(-0.13 + 0.26 * i / 59, static_cast<std::size_t>(k), 16, k).radiance.g);
  return sum / (60.0 * 16.0);
}

/// Each way to the window is found once: by the last face's lights, and not by those of the faces before as well. The
/// lobes meet it by chance, so that both agree within a quarter.
TEST(GlassWalls, a_frosted_hollow_sphere_shows_a_window_by_lights_as_by_lobes_alone) {
  const std::vector<Aperture> panes = test::box_window();
  ObjectMaterial frosted = glass();
  frosted.roughness = 0.4f;
  GlossyScene scene(frosted, {}, panes, 30.0f);
  scene.room.set_walls(0.0f);
  hollow_out(scene, 0.1f);
  const double by_lobes = mean_seen(scene);
  scene.look_at_sky_by_lights(panes);
  EXPECT_GT(by_lobes, 0.02);
  EXPECT_NEAR(mean_seen(scene) / by_lobes, 1.0, 0.25);
}

/// Through clear glass no ray of a rough metal sees the sun; through frosted glass the glass shows it.
TEST(GlassWalls, the_suns_highlight_on_metal_is_seen_through_clear_glass_and_left_to_frosted_glass) {
  for (const bool frosted : {false, true}) {
    GlossyScene scene(metal(0.4f), {}, test::box_window());
    scene.sun = DetectedSun{.direction = glm::normalize(glm::dvec3(-0.1, 2.5, 0.3)), .normal_irradiance = Rgb(7.0f)};
    scene.renew();
    EXPECT_GT(scene.look(0.1).glint.g, 0.0f);
    VirtualObjects::Part pane = scene.objects.parts[0];
    VirtualObjects::Model model = *pane.model;
    model.mesh.materials = {glass()};
    model.mesh.materials[0].roughness = frosted ? 0.4f : 0.0f;
    pane.model = std::make_shared<const VirtualObjects::Model>(std::move(model));
    pane.first_vertex = scene.objects.surface.positions.size();
    const glm::dvec3 aside = 0.5 * scene.sun->direction;
    pane.world_from_object[3] += glm::dvec4(aside, 0.0);
    for (const glm::vec3& p : pane.mesh().positions)
      scene.objects.surface.positions.push_back(scene.middle + aside + glm::dvec3(p));
    scene.objects.parts.push_back(std::move(pane));
    scene.objects.find_bounds(1);
    scene.objects.surface.reflectance.resize(scene.objects.surface.positions.size(), Rgb(1.0f));
    scene.sent.resize(scene.objects.surface.positions.size());
    scene.indirect.resize(scene.sent.size());
    scene.renew();
    EXPECT_EQ(scene.look(0.1).glint.g > 0.0f, !frosted);
  }
}

} // namespace
} // namespace daylit
