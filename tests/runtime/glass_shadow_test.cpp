// The shadow of glass: the straight transmittance of every light, in colour.

#include <gtest/gtest.h>

#include <memory>

#include <glm/exponential.hpp>
#include <tbb/global_control.h>

#include "runtime/indirect/window_visibility.h"
#include "runtime/object/placed_parts.h"
#include "runtime/trace/glass_faces.h"
#include "runtime/trace/light_visibility.h"
#include "scene/material/fresnel.h"
#include "torus_scene.h"

namespace daylit {
namespace {

using test::at;
using test::kHeight;
using test::kWidth;

ObjectMaterial tinted_pane() {
  ObjectMaterial m;
  m.base_colour = Rgb(0.9f, 0.6f, 0.3f);
  m.roughness = 0.0f;
  m.transmission = 0.8f;
  m.thin = true;
  return m;
}

ObjectMaterial green_glass() {
  ObjectMaterial m;
  m.base_colour = Rgb(1.0f);
  m.roughness = 0.0f;
  m.transmission = 1.0f;
  m.attenuation_colour = Rgb(0.2f, 0.8f, 0.4f);
  m.attenuation_distance_m = 0.1f;
  return m;
}

/// A horizontal square around the z axis that faces up, or down.
void add_square(ObjectMesh& mesh, float half, float z, bool up) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (const glm::vec2& p : {glm::vec2(-half, -half), {half, -half}, {half, half}, {-half, half}}) {
    mesh.positions.emplace_back(p, z);
    mesh.normals.emplace_back(0.0f, 0.0f, up ? 1.0f : -1.0f);
    mesh.reflectance.emplace_back(0.0f);
  }
  for (const std::uint32_t k : {1u, 2u})
    mesh.triangles.push_back({first, first + (up ? k : k + 1), first + (up ? k + 1 : k)});
}

/// A square of 0.4 m, and another one below where it has a thickness; sides are left out.
ObjectMesh square(const ObjectMaterial& material, float thickness_m = 0.0f) {
  ObjectMesh mesh;
  mesh.materials = {material};
  add_square(mesh, 0.2f, 0.0f, true);
  if (thickness_m > 0.0f)
    add_square(mesh, 0.2f, -thickness_m, false);
  return mesh;
}

/// Of one mesh after the other, all of them with glass.
ObjectSurface together(const std::vector<std::pair<ObjectMesh, glm::dvec3>>& objects) {
  ObjectSurface all;
  for (const auto& [mesh, position] : objects) {
    const auto vertex = static_cast<std::uint32_t>(all.positions.size());
    if (!mesh.materials.empty())
      all.glass.push_back({std::make_shared<const ObjectMesh>(mesh), static_cast<std::uint32_t>(all.triangles.size())});
    const ObjectSurface one = test::place(mesh, position);
    all.positions.insert(all.positions.end(), one.positions.begin(), one.positions.end());
    all.normals.insert(all.normals.end(), one.normals.begin(), one.normals.end());
    all.reflectance.insert(all.reflectance.end(), one.reflectance.begin(), one.reflectance.end());
    all.drawn_reflectance = all.reflectance;
    for (const auto& t : one.triangles)
      all.triangles.push_back({vertex + t[0], vertex + t[1], vertex + t[2]});
  }
  return all;
}

/// Sixteen rays along w from points 0.1 m apart, 1 m below the x axis.
RayPacket16 row_of_rays(const glm::vec3& w) {
  RayPacket16 rays{};
  for (std::size_t k = 0; k < kLanes; ++k)
    rays.set(k, glm::vec3(0.1f * static_cast<float>(k) - 0.04f, 0.0f, -1.0f), w, 0.0f, 1e30f);
  return rays;
}

struct Passed {
  LaneMask met = 0;
  LaneRgb left;
};
Passed pass_up(const ObjectSurface& objects, const glm::vec3& w = {0.0f, 0.0f, 1.0f}) {
  const std::vector<glm::vec3> positions(objects.positions.begin(), objects.positions.end());
  const auto glass = GlassFaces::build(objects, positions);
  EXPECT_TRUE(glass) << glass.error().message();
  Passed p;
  p.met = glass->pass(0xFFFFu, row_of_rays(w), p.left);
  return p;
}

Rgb pane_passes(float cosine) { return 0.8f * Rgb(0.9f, 0.6f, 0.3f) * (1.0f - fresnel_dielectric(cosine, 1.5f)); }

void expect_left(const Passed& p, int lane, const Rgb& expected) {
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(p.left.channel[c][lane], expected[c], 2e-6f) << c;
}

TEST(GlassFaces, a_thin_pane_leaves_transmission_times_colour_times_one_minus_fresnel) {
  const ObjectSurface pane = together({{square(tinted_pane()), {0, 0, 0}}});
  const Passed straight = pass_up(pane);
  EXPECT_EQ(straight.met, 0b111u) << "x = -0.04, 0.06, 0.16 lie below the square";
  expect_left(straight, 1, pane_passes(1.0f));
  expect_left(straight, 5, Rgb(1.0f));
  const float cosine = 0.8f; // after 1 m up, 0.75 m to the side
  const Passed slanted = pass_up(pane, {-0.6f, 0.0f, cosine});
  EXPECT_EQ(slanted.met, 0x3C0u) << "x - 0.75 within 0.2";
  expect_left(slanted, 7, pane_passes(cosine));
}

TEST(GlassFaces, two_panes_multiply) {
  const Passed p = pass_up(together({{square(tinted_pane()), {0, 0, 0}}, {square(tinted_pane()), {0, 0, 0.3}}}));
  expect_left(p, 1, pane_passes(1.0f) * pane_passes(1.0f));
}

TEST(GlassFaces, solid_glass_absorbs_along_the_straight_way_inside) {
  // 0.05 m thick, crossed at cosine 0.8: 0.0625 m of the 0.1 m that leave the colour.
  const float cosine = 0.8f, face = 1.0f - fresnel_dielectric(cosine, 1.5f);
  const Passed p = pass_up(together({{square(green_glass(), 0.05f), {0, 0, 0}}}), {-0.6f, 0.0f, cosine});
  expect_left(p, 7, face * face * glm::pow(Rgb(0.2f, 0.8f, 0.4f), Rgb(0.625f)));
}

TEST(GlassFaces, an_opaque_material_of_a_mesh_with_glass_is_none_of_them) {
  ObjectMesh mesh = square(tinted_pane(), 0.1f);
  mesh.materials.push_back({});
  mesh.triangle_material = {0, 0, 1, 1};
  const ObjectSurface objects = together({{mesh, {0, 0, 0}}});
  EXPECT_EQ(GlassFaces::mark(objects), (std::vector<std::uint8_t>{1, 1, 0, 0}));
  expect_left(pass_up(objects), 1, pane_passes(1.0f));
}

/// A pane half a metre above the floor, in the sun.
struct PaneScene : test::TorusScene {
  explicit PaneScene(std::vector<std::pair<ObjectMesh, glm::dvec3>> objects = {
                         {square(tinted_pane()), {2.0, 3.9, 0.5}}}) {
    sun = test::sun_through_the_window();
    camera = test::look_at({2.9, 2.0, 1.5}, {1.95, 3.3, 0.0}, kWidth, kHeight, 0.5);
    object = together(objects);
  }
  float cosine() const { return static_cast<float>(glm::normalize(sun->direction).z); }
  /// Of the sun at a pixel of the floor, what the objects leave.
  static Rgb left(const DrawnPixel& p) { return 1.0f - p.lost_sun / p.received.y; }
  /// The floor's point whose light passes through the point.
  glm::dvec3 shadow_of(const glm::dvec3& p) const { return p - sun->direction * (p.z / sun->direction.z); }
  DrawnPixel pixel_at(const RenderedFrame& frame, const glm::dvec3& x) const {
    const glm::dvec3 c = glm::transpose(glm::dmat3(camera.world_from_camera)) * (x - camera.eye());
    return at(frame, static_cast<int>(std::lround(camera.cx + camera.fx * c.x / c.z)),
              static_cast<int>(std::lround(camera.cy + camera.fy * c.y / c.z)));
  }
};

void expect_near(const Rgb& found, const Rgb& expected, float tolerance) {
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(found[c], expected[c], tolerance) << c;
}

TEST(GlassShadow, of_a_pane_in_the_sun_is_even_and_has_the_tint_of_its_transmittance) {
  PaneScene scene;
  const auto frame = scene.trace();
  ASSERT_TRUE(frame) << frame.error().message();
  const Rgb expected = pane_passes(scene.cosine());
  for (double x = 1.85; x < 2.16; x += 0.05)
    for (double y = 3.75; y < 4.06; y += 0.05) {
      const DrawnPixel p = scene.pixel_at(*frame, scene.shadow_of({x, y, 0.5}));
      ASSERT_GT(p.received.y, 0.3f);
      expect_near(PaneScene::left(p), expected, 1e-3f); // the disc is 0.5 degrees wide
    }
}

TEST(GlassShadow, of_two_panes_is_their_product) {
  PaneScene scene({{square(tinted_pane()), {2.0, 3.9, 0.5}}, {square(tinted_pane()), {2.0, 3.9, 0.45}}});
  const auto frame = scene.trace();
  ASSERT_TRUE(frame) << frame.error().message();
  const Rgb one = pane_passes(scene.cosine());
  expect_near(PaneScene::left(scene.pixel_at(*frame, scene.shadow_of({2.0, 3.9, 0.48}))), one * one, 1e-3f);
}

TEST(GlassShadow, an_opaque_thing_behind_the_glass_stops_the_light) {
  PaneScene scene({{square(tinted_pane()), {2.0, 3.9, 0.5}}, {test::torus(0.0f, 0.06f), {2.0, 4.0, 0.55}}});
  const auto frame = scene.trace();
  ASSERT_TRUE(frame) << frame.error().message();
  expect_near(PaneScene::left(scene.pixel_at(*frame, scene.shadow_of({2.0, 4.0, 0.55}))), Rgb(0.0f), 1e-6f);
  expect_near(PaneScene::left(scene.pixel_at(*frame, scene.shadow_of({1.88, 3.8, 0.5}))), pane_passes(scene.cosine()),
              1e-3f);
}

TEST(GlassShadow, the_sky_loses_more_of_the_colours_that_the_pane_keeps) {
  PaneScene scene;
  scene.sun.reset();
  const auto frame = scene.trace(), opaque = [&] {
    PaneScene other;
    other.sun.reset();
    other.object.glass.clear();
    return other.trace();
  }();
  ASSERT_TRUE(frame && opaque);
  const glm::dvec3 x(1.95, 3.4, 0.0);
  const Rgb lost(scene.pixel_at(*frame, x).lost_sky), all(scene.pixel_at(*opaque, x).lost_sky);
  ASSERT_GT(all.g, 0.1f);
  for (int c = 0; c < 3; ++c) { // 1 - F lies between that at 60 degrees and that face on
    EXPECT_GT(lost[c] / all[c], 1.0f - pane_passes(1.0f)[c] - 1e-3f);
    EXPECT_LT(lost[c] / all[c], 1.0f - pane_passes(0.5f)[c] + 1e-3f);
  }
}

TEST(GlassShadow, follows_the_pane_that_moves_and_its_new_colour) {
  PaneScene scene;
  auto renderer = *TracedRenderer::make(scene.room, scene.windows, {});
  ASSERT_TRUE(scene.render(renderer));
  for (const bool clear : {false, true}) {
    ObjectMaterial material = tinted_pane();
    material.transmission = clear ? 0.5f : 0.8f;
    scene.object = clear ? together({{square(material), {1.55, 3.7, 0.4}}}) : scene.object;
    if (!clear)
      for (glm::dvec3& p : scene.object.positions)
        p += glm::dvec3(-0.45, -0.2, -0.1);
    const auto frame = scene.render(renderer);
    ASSERT_TRUE(frame);
    const Rgb expected = pane_passes(scene.cosine()) * material.transmission / 0.8f;
    expect_near(PaneScene::left(scene.pixel_at(*frame, scene.shadow_of({1.55, 3.7, 0.4}))), expected, 1e-3f);
  }
}

TEST(GlassShadow, does_not_depend_on_the_number_of_threads) {
  PaneScene scene({{square(green_glass(), 0.05f), {2.0, 3.9, 0.5}}, {test::torus(0.1f, 0.03f), {2.0, 4.0, 0.6}}});
  const auto many = scene.trace();
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const auto single = scene.trace();
  ASSERT_TRUE(many && single);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const DrawnPixel a = at(*many, x, y), b = at(*single, x, y);
      ASSERT_EQ(a.lost_sun, b.lost_sun) << x << ", " << y;
      ASSERT_EQ(a.lost_sky, b.lost_sky) << x << ", " << y;
    }
}

/// A floor below the pane and a light above it: one ray for what is opaque, one more for glass where there is some.
TEST(GlassShadow, without_glass_no_ray_is_traced_for_it) {
  const ObjectSurface pane = together({{square(tinted_pane()), {0, 0, 0.5}}});
  const std::vector<glm::vec3> positions(pane.positions.begin(), pane.positions.end());
  const PacketScene nothing = *PacketScene::build({}, {});
  const GlassFaces glass = *GlassFaces::build(pane, positions);
  TracedLights lights;
  const DirectionalLight up{glm::dvec3(0, 0, 1), Rgb(1.0f)};
  const Aperture ceiling{{{-9, -9, 2}, {-9, 9, 2}, {9, 9, 2}, {9, -9, 2}}, {0, 0, -1}, Rgb(1.0f)};
  lights.portal = PortalLights(std::span(&up, 1), std::span(&ceiling, 1), glm::dvec3(0.0));
  PointBlock floor;
  floor.set(0, {0.05f, 0.05f, 0.0f}, {0, 0, 1});
  floor.close(1);
  for (const GlassFaces* some : {static_cast<const GlassFaces*>(nullptr), &glass}) {
    const ShadowCasters casters{&nothing, some, &nothing, {0, 0, 0.5f}, 0.5f, {-0.2f, -0.2f, 0.5f}, {0.2f, 0.2f, 0.5f}};
    BlockedLights blocked;
    EXPECT_EQ(find_blocked_lights(lights, casters, Layer::room, floor, RayStarts(floor), {}, blocked), some ? 2u : 1u);
    EXPECT_EQ(blocked.left.size(), some ? 1u : 0u);
  }
}

TEST(LightHints, a_light_that_glass_weakens_is_believed_of_no_other_point) {
  const KnownLights clear{1, 0}, weakened{1, 1}, blocked{0, 1};
  for (const KnownLights* other : {&clear, &blocked}) {
    const KnownLights* around[] = {other, other, &weakened};
    LightHints hints;
    hints.reset(1);
    hints.believe_agreeing(0, around);
    hints.believe_corners(around);
    EXPECT_EQ(hints.verdicts()[0].clear | hints.verdicts()[0].blocked, 0u);
  }
}

TEST(PlacedParts, let_light_pass_by_the_product_of_their_mean_transmittances) {
  const ObjectMesh mesh = square(tinted_pane());
  const RayScene rays =
      *RayScene::build(std::vector<glm::dvec3>(mesh.positions.begin(), mesh.positions.end()), mesh.triangles);
  const auto stack = [&](int panes, bool opaque_above) {
    std::vector<PlacedPart> parts;
    for (int k = 0; k < panes + opaque_above; ++k) {
      glm::dmat4 world(1.0);
      world[3].z = 0.5 + 0.1 * k;
      parts.push_back({&rays, mesh.triangles, mesh.positions, 0, world});
      parts.back().glass = k < panes ? &mesh : nullptr;
      parts.back().transmittance = k < panes ? Rgb(0.5f, 0.7f, 0.9f) : Rgb(0.0f);
    }
    return PlacedParts(std::move(parts)).passed({0.05, 0.05, 0.0}, {0, 0, 1});
  };
  EXPECT_EQ(stack(0, false), Rgb(1.0f));
  expect_near(stack(2, false), Rgb(0.25f, 0.49f, 0.81f), 1e-6f);
  EXPECT_EQ(stack(1, true), Rgb(0.0f));
}

TEST(PlacedParts, let_light_straight_through_each_face_that_one_of_them_has_on_the_way) {
  const float through = 1.0f - fresnel_dielectric(1.0f, 1.5f);
  const ObjectMesh mesh = square(green_glass(), 0.02f);
  const RayScene rays =
      *RayScene::build(std::vector<glm::dvec3>(mesh.positions.begin(), mesh.positions.end()), mesh.triangles);
  glm::dmat4 world(2.0); // 4 cm thick
  world[3] = {0.0, 0.0, 1.0, 1.0};
  const PlacedPart part{&rays, mesh.triangles, mesh.positions, 0, world, &mesh};
  const auto passed = [&](double z) { return PlacedParts({part}).passed_straight(0, {0.05, 0.05, z}, {0, 0, 1}); };
  const Rgb absorbed = glm::pow(Rgb(0.2f, 0.8f, 0.4f), Rgb(0.4f));
  expect_near(passed(0.0), through * through * absorbed, 1e-4f);
  expect_near(passed(0.96), through * through * absorbed, 1e-4f); // on the lower face
  expect_near(passed(0.98), through * glm::sqrt(absorbed), 1e-4f);
  EXPECT_EQ(passed(1.5), Rgb(1.0f));
}

/// A window overhead, 1 m wide and 2 m away; a pane of 0.4 m half a metre away covers it, or its half.
TEST(WindowVisibility, glass_keeps_of_the_windows_that_it_covers_what_its_faces_do_not_let_through) {
  const ObjectMesh mesh = square(tinted_pane());
  const RayScene pane =
      *RayScene::build(std::vector<glm::dvec3>(mesh.positions.begin(), mesh.positions.end()), mesh.triangles);
  Room speck; // that hides nothing
  speck.vertices = {{9, 9, 9}, {9.1, 9, 9}, {9, 9.1, 9}};
  speck.materials = {{"black", Rgb(0.0f), Rgb(1.0f), false}};
  speck.triangles = {{{0, 1, 2}, 0}};
  const RayScene room = *RayScene::build(speck);
  const std::vector<Aperture> overhead = {
      {{{-0.5, -0.5, 2}, {0.5, -0.5, 2}, {0.5, 0.5, 2}, {-0.5, 0.5, 2}}, {0, 0, -1}, Rgb(1.0f)}};
  const WindowVisibility windows(room, overhead);
  const Rgb passed = 0.8f * (1.0f - fresnel_dielectric(1.0f, 1.5f)) * Rgb(0.9f, 0.6f, 0.3f);
  const auto kept = [&](double aside, bool opaque_above) {
    std::vector<PlacedPart> parts;
    for (int k = 0; k < 1 + opaque_above; ++k) {
      glm::dmat4 world(1.0);
      world[3] = {aside, 0.0, 0.5 + 0.05 * k, 1.0};
      parts.push_back({&pane, mesh.triangles, mesh.positions, 0, world});
      parts.back().glass = k == 0 ? &mesh : nullptr;
    }
    const PlacedParts placed(std::move(parts));
    return windows.kept_by_glass({0, 0, 0}, {0, 0, 1}, placed);
  };
  expect_near(kept(0.0, false), 1.0f - passed, 1e-3f);
  expect_near(kept(0.2, false), 0.5f * (1.0f - passed), 1e-3f);
  expect_near(kept(2.0, false), Rgb(0.0f), 1e-6f);
  expect_near(kept(0.0, true), Rgb(0.0f), 1e-6f);
}

} // namespace
} // namespace daylit
