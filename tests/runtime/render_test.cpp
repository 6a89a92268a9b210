#include <gtest/gtest.h>

#include <cstring>

#include "direct_reference.h"
#include "runtime/composite/compose.h"
#include "test_scene.h"

namespace daylit {
namespace {

constexpr int kWidth = 128, kHeight = 124;

/// A torus on the floor of the box room, its lights, and the picture of it.
struct Scene {
  Room room = test::box_room();
  std::vector<Aperture> windows = test::box_window();
  ObjectSurface object = test::place(test::torus(0.15f, 0.07f, 160, 80), {2.0, 3.4, 0.23}, 1.2);
  SkyMap sky = test::overcast_sky();
  std::optional<DetectedSun> sun;
  RenderCamera camera = test::look_at({3.0, 4.6, 1.1}, {2.0, 3.4, 0.2}, kWidth, kHeight, 0.6);
  int samples = 64;
  RenderSettings settings;

  std::vector<SkyMap> pyramid;
  LightSet lights;
  std::vector<ApertureCell> cells;

  Result<RenderedFrame> render() {
    auto context = create_gl_context();
    if (!context)
      return context.error();
    auto renderer = Renderer::make(std::move(*context), room, windows, settings);
    if (!renderer)
      return renderer.error();
    pyramid = sky_map_pyramid(sky);
    const BoundingSphere sphere = object.bounds();
    lights = sample_lights(sky, sun, windows, sphere, samples);
    cells = aperture_cells(windows, sphere, pyramid);
    const std::vector<Rgb> open = open_sky_irradiance(pyramid, cells, object.positions, object.normals);
    std::vector<VertexLight> light(open.size());
    for (std::size_t i = 0; i < open.size(); ++i)
      light[i].open_sky_front = open[i];
    if (const auto r = renderer->set_camera(camera); !r)
      return r.error();
    if (const auto r = renderer->set_objects(object); !r)
      return r.error();
    if (const auto r = renderer->set_lights(lights); !r)
      return r.error();
    if (const auto r = renderer->set_vertex_light(every_vertex(light.size()), light); !r)
      return r.error();
    RenderedFrame frame;
    if (const auto r = renderer->draw(frame); !r)
      return r.error();
    return frame;
  }
};

DetectedSun sun_through_the_window() {
  DetectedSun sun;
  sun.direction = glm::normalize(glm::dvec3(0.1, 1.6, 1.3));
  sun.normal_irradiance = Rgb(5.0f);
  return sun;
}

struct Deviation {
  double object = 0, shadow = 0; ///< RMS of GL minus ray traced, over the mean of what is received without the object
  int object_pixels = 0, shadow_pixels = 0;
};

/// Every second pixel of the picture against the slow twin.
Deviation compare_with_rays(Scene& scene, const RenderedFrame& frame) {
  const test::DirectReference reference(scene.room, scene.windows, scene.object);
  const RayScene object = *RayScene::build(scene.object.positions, scene.object.triangles);
  const RayScene room = *RayScene::build(scene.room);
  const glm::dvec3 eye = scene.camera.eye();
  Deviation d;
  double object_mean = 0, room_mean = 0;
  for (int y = 0; y < kHeight; y += 2)
    for (int x = 0; x < kWidth; x += 2) {
      const DrawnPixel shown = frame.shown(x, y) ? frame.at(x, y) : DrawnPixel{};
      const glm::dvec3 w = scene.camera.direction({x, y});
      RayHit hit;
      if (shown.object.w > 0.999f && object.closest(object.to_local(eye), glm::vec3(w), 0, 100, hit)) {
        const auto& t = scene.object.triangles[hit.triangle];
        const auto& normals = scene.object.normals;
        const glm::dvec3 n(
            glm::normalize(normals[t[0]] * (1 - hit.u - hit.v) + normals[t[1]] * hit.u + normals[t[2]] * hit.v));
        const glm::dvec3 p = eye + w * static_cast<double>(hit.distance);
        const double exact =
            static_cast<double>(reference.estimate(scene.lights, scene.pyramid, scene.cells, p, n).with.g);
        const double drawn = static_cast<double>(shown.object.y) / 0.5 * std::numbers::pi;
        d.object += (drawn - exact) * (drawn - exact);
        object_mean += exact;
        ++d.object_pixels;
      } else if (shown.lost_sky.w > 0.999f && room.closest(room.to_local(eye), glm::vec3(w), 0, 100, hit)) {
        glm::dvec3 n = glm::normalize(area_normal(scene.room, scene.room.triangles[hit.triangle]));
        n = glm::dot(n, w) > 0 ? -n : n;
        const glm::dvec3 p = eye + w * static_cast<double>(hit.distance);
        const auto e = reference.estimate(scene.lights, scene.pyramid, scene.cells, p, n);
        const double lost = static_cast<double>(e.without.g - e.with.g);
        const double sun = scene.sun ? static_cast<double>(scene.sun->normal_irradiance.g) : 0.0;
        const double open = static_cast<double>(open_sky_irradiance(scene.pyramid, scene.cells, p, n).g);
        const double drawn = static_cast<double>(shown.lost_sky.y) * open + static_cast<double>(shown.lost_sun.g) * sun;
        if (lost <= 0.02 * static_cast<double>(e.without.g) && drawn <= 0.0)
          continue;
        d.shadow += (drawn - lost) * (drawn - lost);
        room_mean += static_cast<double>(e.without.g);
        ++d.shadow_pixels;
      }
    }
  d.object = std::sqrt(d.object / d.object_pixels) / (object_mean / d.object_pixels);
  d.shadow = std::sqrt(d.shadow / d.shadow_pixels) / (room_mean / d.shadow_pixels);
  return d;
}

TEST(Renderer, direct_light_under_overcast_agrees_with_rays) {
  Scene scene;
  const auto frame = scene.render();
  ASSERT_TRUE(frame) << frame.error().message();
  const Deviation d = compare_with_rays(scene, *frame);
  EXPECT_GT(d.object_pixels, 200);
  EXPECT_GT(d.shadow_pixels, 100);
  EXPECT_LT(d.object, 0.03); // the shadow maps' texels and bias: what is left against exact visibility
  EXPECT_LT(d.shadow, 0.02);
}

TEST(Renderer, light_through_clear_glass_agrees_with_rays) {
  Scene scene;
  for (Aperture& a : scene.windows)
    a.refractive_index = 1.52f;
  const auto frame = scene.render();
  ASSERT_TRUE(frame) << frame.error().message();
  const Deviation d = compare_with_rays(scene, *frame);
  EXPECT_LT(d.object, 0.03);
  EXPECT_LT(d.shadow, 0.02);
}

TEST(Renderer, direct_light_with_sun_agrees_with_rays) {
  Scene scene;
  scene.sun = sun_through_the_window();
  const auto frame = scene.render();
  ASSERT_TRUE(frame) << frame.error().message();
  ASSERT_EQ(scene.lights.sun.size(), 16u);
  const Deviation d = compare_with_rays(scene, *frame);
  EXPECT_LT(d.object, 0.04); // hard shadow edges fall between texels
  EXPECT_LT(d.shadow, 0.08);
}

TEST(Renderer, furniture_shadows_take_no_light_twice) {
  // A screen between window and object: the floor behind it is in the shade already, the object adds nothing there.
  Scene scene;
  test::add_block(scene.room, {0.3, 4.2, 0.0}, {3.7, 4.25, 2.6}, 0);
  const auto frame = scene.render();
  ASSERT_TRUE(frame) << frame.error().message();
  EXPECT_GT(occluding_triangles(scene.room, scene.windows).size(), 0u);
  const Deviation d = compare_with_rays(scene, *frame);
  EXPECT_LT(d.shadow_pixels == 0 ? 0.0 : d.shadow, 0.05);
}

TEST(Renderer, an_object_behind_a_real_wall_changes_nothing_but_its_shadow) {
  Scene scene;
  scene.camera = test::look_at({2.0, 1.0, 1.4}, {2.0, 0.0, 1.4}, kWidth, kHeight, 0.6); // looks at the rear wall
  scene.object = test::place(test::torus(0.15f, 0.07f), {2.0, -0.5, 1.4});
  const auto frame = scene.render();
  ASSERT_TRUE(frame) << frame.error().message();
  const RgbImage photo(kWidth, kHeight, Rgb(0.25f));
  const Composite composite = compose(photo, *frame, scene.camera,
                                      [](const glm::dvec3&, std::uint32_t) { return std::optional(RoomPoint{}); }, {});
  EXPECT_EQ(composite.object_pixels, 0u);
  EXPECT_EQ(composite.shadow_pixels, 0u);
  EXPECT_EQ(0, std::memcmp(composite.picture.texels.data(), photo.texels.data(), photo.texels.size() * sizeof(Rgb)));
}

TEST(Renderer, a_black_sky_and_no_object_are_defined) {
  Scene black;
  std::fill(black.sky.radiance.begin(), black.sky.radiance.end(), Rgb(0.0f));
  Scene empty;
  empty.object = {};
  for (Scene* scene : {&black, &empty}) {
    const auto frame = scene->render();
    ASSERT_TRUE(frame) << frame.error().message();
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        if (frame->shown(x, y)) {
          ASSERT_TRUE(test::is_finite(frame->at(x, y)));
          ASSERT_EQ(glm::vec3(frame->at(x, y).lost_sky), glm::vec3(0.0f));
        }
  }
}

TEST(Renderer, object_edges_are_covered_in_part) {
  Scene scene;
  const auto frame = scene.render();
  ASSERT_TRUE(frame) << frame.error().message();
  std::size_t partly = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      if (!frame->shown(x, y))
        continue;
      const DrawnPixel& p = frame->at(x, y);
      partly += p.object.w > 0.1f && p.object.w < 0.9f;
      ASSERT_NEAR(p.object.w + p.lost_sky.w, 1.0f, 1e-6f) << "every sample shows object or room";
    }
  EXPECT_GT(partly, 50u);
}

TEST(RoomOccluders, a_convex_empty_room_has_none) {
  const Room room = test::box_room();
  EXPECT_TRUE(occluding_triangles(room, test::box_window()).empty());
}

TEST(RoomOccluders, furniture_counts_and_so_does_everything_when_a_window_is_recessed) {
  Room room = test::box_room();
  test::add_block(room, {1, 1, 0}, {2, 2, 1}, 0);
  const auto furniture = occluding_triangles(room, test::box_window());
  EXPECT_EQ(furniture.size(), 10u) << "all faces of the block but the one on the floor";
  test::add_block(room, {0, 6, 0}, {4, 6.1, 3}, 0); // a wall opposite the window
  EXPECT_EQ(occluding_triangles(room, test::box_window()).size(), room.triangles.size());
}

} // namespace
} // namespace daylit
