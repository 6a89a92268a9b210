// The picture by rays: against the slow twin, against OpenGL, and where there is nothing sensible to draw.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "direct_reference.h"
#include "runtime/composite/compose.h"
#include "runtime/gl/renderer.h"
#include "runtime/trace/surface_points.h"
#include "runtime/trace/traced_renderer.h"
#include "torus_scene.h"

namespace daylit {
namespace {

using test::at;
using test::kHeight;
using test::kWidth;
using test::sun_through_the_window;
using Scene = test::TorusScene;

struct Difference {
  double object = 0, lost = 0; ///< RMS: radiance of the object by its mean; share of the sky's light lost, where any is
};

/// Over the pixels that neither picture has at an edge.
Difference compare(const RenderedFrame& a, const RenderedFrame& b) {
  double object = 0, object_mean = 0, lost = 0;
  for (int y = 0; y < a.height_px; ++y)
    for (int x = 0; x < a.width_px; ++x) {
      const glm::vec4 p = at(a, x, y).object, q = at(b, x, y).object;
      if (p.w > 0.999f && q.w > 0.999f) {
        object += static_cast<double>((p.y - q.y) * (p.y - q.y));
        object_mean += static_cast<double>(q.y);
      } else if (p.w < 0.001f && q.w < 0.001f) {
        const float s = at(a, x, y).lost_sky.y, t = at(b, x, y).lost_sky.y;
        lost += static_cast<double>((s - t) * (s - t)) * static_cast<double>(t > 0.0f || s > 0.0f);
      }
    }
  double object_count = 0, lost_count = 0;
  for (int y = 0; y < b.height_px; ++y)
    for (int x = 0; x < b.width_px; ++x) {
      object_count += at(b, x, y).object.w > 0.999f;
      lost_count += at(b, x, y).lost_sky.y > 0.0f;
    }
  return {std::sqrt(object / object_count) / (object_mean / object_count), std::sqrt(lost / lost_count)};
}

TEST(TracedRenderer, lost_light_equals_the_slow_twin_at_every_pixel) {
  Scene scene;
  const auto frame = scene.trace(false);
  ASSERT_TRUE(frame) << frame.error().message();
  const test::DirectReference reference(scene.room, scene.windows, scene.object);
  const RayScene room = *RayScene::build(scene.room);
  const glm::dvec3 eye = scene.camera.eye();
  int shadowed = 0, wrong = 0;
  for (int y = 0; y < kHeight; y += 3)
    for (int x = 0; x < kWidth; x += 3) {
      if (at(*frame, x, y).object.w > 0.0f)
        continue;
      RayHit hit;
      const glm::dvec3 w = scene.camera.direction({x, y});
      if (!room.closest(room.to_local(eye), glm::vec3(w), 0, 100, hit))
        continue;
      glm::dvec3 n = glm::normalize(area_normal(scene.room, scene.room.triangles[hit.triangle]));
      n = glm::dot(n, w) > 0 ? -n : n;
      const glm::dvec3 p = eye + w * static_cast<double>(hit.distance);
      const auto e = reference.estimate(scene.lights, scene.pyramid, scene.cells, p, n);
      const float exact = 1.0f - e.with.g / e.without.g, drawn = at(*frame, x, y).lost_sky.y;
      shadowed += exact > 0.0f;
      wrong += std::fabs(exact - drawn) > 1e-3f;
    }
  EXPECT_GT(shadowed, 100);
  EXPECT_LE(wrong, shadowed / 50) << "rays that graze the object's facets may fall to either side";
}

TEST(TracedRenderer, where_an_object_takes_light_what_the_room_takes_of_it_is_known) {
  Scene scene;
  const auto first = static_cast<std::uint32_t>(scene.room.vertices.size());
  for (const glm::dvec3& corner : {glm::dvec3(1.2, 4.2, 0.0), {2.0, 4.2, 0.0}, {2.0, 4.2, 2.6}, {1.2, 4.2, 2.6}})
    scene.room.vertices.push_back(corner); // a board before half of the window
  for (const std::uint32_t k : {1u, 2u})
    scene.room.triangles.push_back({{first, first + k, first + k + 1}, scene.room.triangles[0].material});
  const auto frame = scene.trace(false);
  ASSERT_TRUE(frame) << frame.error().message();
  const test::DirectReference reference(scene.room, scene.windows, scene.object);
  int shadowed = 0, half = 0, wrong = 0;
  for (int y = 0; y < kHeight; y += 3)
    for (int x = 0; x < kWidth; x += 3) {
      const DrawnPixel pixel = at(*frame, x, y);
      const glm::dvec3 eye = scene.camera.eye(), w = scene.camera.direction({x, y}), p = eye - w * (eye.z / w.z);
      if (pixel.object.w > 0.0f || pixel.lost_sky.y <= 0.0f || w.z >= 0.0 || p.y > 4.1 || p.y < 0.0 || p.x > 4.0)
        continue; // the floor before the board
      const auto e = reference.estimate(scene.lights, scene.pyramid, scene.cells, p, {0, 0, 1});
      const Rgb open = open_sky_irradiance(scene.pyramid, scene.cells, p, {0, 0, 1});
      ++shadowed;
      half += e.without.g < 0.8f * open.g;
      wrong += std::fabs(pixel.received.x - e.without.g / open.g) > 1e-3f;
    }
  EXPECT_GT(half, 50);
  EXPECT_LE(wrong, shadowed / 50) << "what is lost counts beside what there was";
}

TEST(TracedRenderer, agrees_with_open_gl) {
  for (const bool with_sun : {false, true}) {
    Scene scene;
    if (with_sun)
      scene.sun = sun_through_the_window();
    auto context = create_gl_context();
    ASSERT_TRUE(context) << context.error().message();
    auto gl = Renderer::make(std::move(*context), scene.room, scene.windows);
    ASSERT_TRUE(gl) << gl.error().message();
    const auto drawn = scene.render(*gl);
    const auto traced = scene.trace();
    ASSERT_TRUE(drawn && traced);
    const Difference d = compare(*traced, *drawn);
    EXPECT_LT(d.object, with_sun ? 0.03 : 0.02) << "texels and bias of the shadow maps";
    EXPECT_LT(d.lost, 0.02) << "steps of 64 lights, each 1.6 %, one texel to either side";
    double covered = 0, both = 0;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const float p = at(*traced, x, y).object.w, q = at(*drawn, x, y).object.w;
        covered += static_cast<double>(std::max(p, q));
        both += static_cast<double>(std::min(p, q));
      }
    EXPECT_GT(both / covered, 0.98);
  }
}

/// Between two corners the lost share climbs in steps of about 1 / n, one per light, at places spread like random
/// ones. Around the straight line the sum of k such steps s has a variance of k s^2 t (1 - t), on average k s^2 / 6;
/// corners further apart than 0.35, k = 22, are not interpolated. Shadows that all corners miss come on top.
double steps_of_interpolation(std::size_t lights) { return std::sqrt(0.35 / static_cast<double>(lights) / 6.0); }

TEST(TracedRenderer, the_grid_changes_little_whatever_the_size_of_the_picture) {
  for (const int width : {96, 176, 384}) {
    Scene scene;
    scene.sun = sun_through_the_window();
    scene.camera = test::look_at({3.0, 4.6, 1.1}, {2.0, 3.4, 0.2}, width, width, 0.6);
    const auto all = scene.trace(false), shared = scene.trace(true);
    ASSERT_TRUE(all && shared);
    const Difference d = compare(*shared, *all);
    EXPECT_LT(d.object, 0.02) << width;
    EXPECT_LT(d.lost, steps_of_interpolation(scene.lights.sky.size())) << width;
  }
}

TEST(TracedRenderer, a_dense_mesh_is_lit_at_one_vertex_a_pixel_and_looks_the_same) {
  Scene coarse, dense;
  dense.object = test::place(test::torus(0.15f, 0.07f, 800, 400), {2.0, 3.4, 0.23}, 1.2);
  auto renderer = TracedRenderer::make(dense.room, dense.windows, {});
  ASSERT_TRUE(renderer);
  const auto all = coarse.trace(), few = dense.render(*renderer);
  ASSERT_TRUE(all && few);
  const Difference d = compare(*few, *all);
  EXPECT_LT(d.object, 0.02);
  EXPECT_LT(d.lost, steps_of_interpolation(coarse.lights.sky.size()));
  std::size_t pixels = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      pixels += at(*few, x, y).object.w > 0.0f;
  const auto lit = renderer->vertices_in_view();
  ASSERT_TRUE(lit);
  EXPECT_TRUE(std::ranges::is_sorted(*lit));
  EXPECT_GT(lit->size(), pixels / 2);
  EXPECT_LT(lit->size(), 5 * pixels / 4) << "some at outlines have three";
}

TEST(TracedRenderer, blocks_of_one_plane_lose_what_their_pixels_lose_one_by_one) {
  Scene scene;
  scene.camera = test::look_at({3.0, 4.6, 1.1}, {2.0, 3.4, 0.2}, 384, 384, 0.6);
  auto renderer = TracedRenderer::make(scene.room, scene.windows);
  ASSERT_TRUE(renderer);
  const auto blocks = scene.render(*renderer);
  ASSERT_TRUE(blocks) << blocks.error().message();
  // Where a sun shines, were it black, every pixel is looked at by itself.
  scene.lights.sun = {{scene.lights.sky.front().direction, Rgb(0.0f)}};
  RenderedFrame pixels;
  ASSERT_TRUE(renderer->set_lights(scene.lights));
  ASSERT_TRUE(renderer->draw(pixels));
  int shadowed = 0;
  for (int y = 0; y < blocks->height_px; ++y)
    for (int x = 0; x < blocks->width_px; ++x) {
      const glm::vec4 a = at(*blocks, x, y).lost_sky, b = at(pixels, x, y).lost_sky;
      for (int c = 0; c < 3; ++c)
        ASSERT_NEAR(a[c], b[c], 2e-6f) << x << ", " << y;
      if (!(b.y > 0.0f))
        continue;
      ++shadowed;
      ASSERT_NEAR(a.w, b.w, 1e-6f);
      ASSERT_NEAR(at(*blocks, x, y).received.x, at(pixels, x, y).received.x, 2e-6f) << x << ", " << y;
      ASSERT_EQ(at(*blocks, x, y).triangle, at(pixels, x, y).triangle);
    }
  EXPECT_GT(shadowed, 10000);
}

TEST(TracedRenderer, the_grid_loses_no_shadow_where_two_parts_touch) {
  Scene scene;
  scene.object = test::place(test::ring_with_wire(), {2.0, 3.4, 0.23}, 1.2);
  scene.camera = test::look_at({3.0, 4.6, 1.1}, {2.0, 3.4, 0.2}, 384, 384, 0.6);
  const auto all = scene.trace(false), shared = scene.trace(true);
  ASSERT_TRUE(all && shared);
  EXPECT_LT(compare(*shared, *all).object, 0.02);
}

/// An upright sheet of 30 x 30 cm before the window, its foot on the floor.
ObjectMesh sheet() {
  constexpr int kCut = 30;
  ObjectMesh mesh;
  for (int j = 0; j <= kCut; ++j)
    for (int i = 0; i <= kCut; ++i) {
      mesh.positions.emplace_back(0.3f * (static_cast<float>(i) / kCut - 0.5f), 0.0f,
                                  0.3f * static_cast<float>(j) / kCut);
      mesh.normals.emplace_back(0.0f, -1.0f, 0.0f);
      mesh.reflectance.emplace_back(0.5f);
    }
  for (std::uint32_t j = 0; j < kCut; ++j)
    for (std::uint32_t i = 0; i < kCut; ++i) {
      const std::uint32_t a = j * (kCut + 1) + i;
      mesh.triangles.push_back({a, a + 1, a + kCut + 2});
      mesh.triangles.push_back({a, a + kCut + 2, a + kCut + 1});
    }
  return mesh;
}

TEST(TracedRenderer, light_behind_a_thin_sheet_does_not_come_through_at_its_foot) {
  Scene scene;
  scene.object = test::place(sheet(), {2.0, 3.3, 0.0});
  scene.camera = test::look_at({2.3, 2.0, 0.9}, {2.0, 3.3, 0.05}, 300, 300, 0.4);
  const auto grid = scene.trace(), every = scene.trace(false);
  ASSERT_TRUE(grid && every);
  int foot = 0;
  for (int y = 0; y < grid->height_px; ++y)
    for (int x = 0; x < grid->width_px; ++x)
      if (const glm::vec4 a = at(*grid, x, y).lost_sky, b = at(*every, x, y).lost_sky; b.y > 0.05f) {
        ASSERT_NEAR(a.y, b.y, 0.2f * b.w) << x << ", " << y;
        ++foot;
      }
  EXPECT_GT(foot, 3000);
}

TEST(TracedRenderer, the_picture_does_not_depend_on_what_was_drawn_before) {
  Scene scene;
  auto renderer = TracedRenderer::make(scene.room, scene.windows);
  ASSERT_TRUE(renderer);
  Scene elsewhere;
  elsewhere.object = test::place(test::torus(0.15f, 0.07f, 160, 80), {1.8, 3.0, 0.3}, 0.3);
  elsewhere.camera = test::look_at({2.5, 4.4, 1.3}, {2.0, 3.4, 0.2}, kWidth, kHeight, 0.7);
  ASSERT_TRUE(elsewhere.render(*renderer));
  const auto again = scene.render(*renderer), fresh = scene.trace();
  ASSERT_TRUE(again && fresh);
  ASSERT_EQ(again->box, fresh->box);
  EXPECT_LT(compare(*again, *fresh).object, 1e-3) << "a refitted hierarchy finds the same hits";
}

TEST(TracedRenderer, grid_points_of_another_view_are_forgotten) {
  Scene scene;
  auto moved = TracedRenderer::make(scene.room, scene.windows), still = TracedRenderer::make(scene.room, scene.windows);
  ASSERT_TRUE(moved && still);
  constexpr int kSide = 360; // the object is wide enough for coarse points
  const auto looking_at = [](const glm::dvec3& x) { return test::look_at({3.0, 4.6, 1.1}, x, kSide, kSide, 0.6); };
  const glm::dvec3 middle(2.0, 3.4, 0.2);
  scene.camera = looking_at(middle);
  ASSERT_TRUE(scene.render(*still));
  for (const double aside_m : {-0.02, -0.01, 0.01, 0.02}) // the object lies a block or two beside where it will be
    for (const glm::dvec3& way : {glm::dvec3(0, 0, 1), glm::dvec3(1, 0, 0)}) {
      scene.camera = looking_at(middle + aside_m * way);
      ASSERT_TRUE(scene.render(*moved));
    }
  scene.camera = looking_at(middle);
  const auto a = scene.render(*moved), b = scene.render(*still);
  ASSERT_TRUE(a && b);
  EXPECT_EQ(moved->shadow_rays(), still->shadow_rays());
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      ASSERT_EQ(at(*a, x, y).object, at(*b, x, y).object) << x << " " << y;
      ASSERT_EQ(at(*a, x, y).lost_sky, at(*b, x, y).lost_sky) << x << " " << y;
    }
}

TEST(TracedRenderer, an_object_where_none_can_be_seen_is_defined) {
  const glm::dvec3 eye{3.0, 4.6, 1.1};
  for (const glm::dvec3& place : {glm::dvec3(2.0, 5.0, 1.5), glm::dvec3(2.0, -0.5, 1.4), glm::dvec3(0.0, 2.0, 1.0), eye,
                                  glm::dvec3(20.0, 0.0, 0.0)}) {
    Scene scene;
    scene.object = test::place(test::torus(0.15f, 0.07f), place);
    const auto frame = scene.trace();
    ASSERT_TRUE(frame) << frame.error().message();
    const RgbImage photo(kWidth, kHeight, Rgb(0.25f));
    const Composite composite = compose(
        photo, *frame, scene.camera, [](const glm::dvec3&, std::uint32_t) { return std::optional(RoomPoint{}); }, {});
    for (std::size_t i = 0; i < photo.texels.size(); ++i) {
      const Rgb& c = composite.picture.texels[i];
      ASSERT_TRUE(std::isfinite(c.r) && std::isfinite(c.g) && std::isfinite(c.b));
      if (composite.touched[i] == 0) {
        ASSERT_EQ(0, std::memcmp(&c, &photo.texels[i], sizeof(Rgb)));
      }
    }
  }
}

TEST(TracedRenderer, extreme_skies_and_empty_objects_are_defined) {
  Scene black, empty, flash;
  std::fill(black.sky.radiance.begin(), black.sky.radiance.end(), Rgb(0.0f));
  empty.object = {};
  flash.sky.radiance[static_cast<std::size_t>(100) * flash.sky.width + 100] = Rgb(1e9f);
  for (Scene* scene : {&black, &empty, &flash}) {
    const auto frame = scene->trace();
    ASSERT_TRUE(frame) << frame.error().message();
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        ASSERT_TRUE(test::is_finite(at(*frame, x, y)));
  }
  EXPECT_TRUE(empty.trace()->box.empty()) << "nothing to draw, no pixel is looked at";
}

TEST(TracedRenderer, blocks_that_show_nothing_are_not_kept) {
  Scene scene;
  scene.sun = sun_through_the_window(); // then every block it reaches is looked at
  const auto frame = scene.trace();
  ASSERT_TRUE(frame) << frame.error().message();
  int kept = 0, idle = 0;
  for (int row = 0; row < frame->rows(); ++row)
    for (int column = 0; column < frame->columns(); ++column) {
      bool any = false;
      for (int k = 0; k < 16 && frame->shows(column, row); ++k) {
        const DrawnPixel& p = frame->at(4 * column + k % 4, 4 * row + k / 4);
        any = any || p.object.w > 0.0f || p.lost_sun.g > 0.0f || glm::vec3(p.lost_sky) != glm::vec3(0.0f);
      }
      kept += frame->shows(column, row);
      idle += frame->shows(column, row) && !any;
    }
  EXPECT_GT(kept, 200);
  EXPECT_LE(idle, kept / 50) << "all but some beside the outline";
}

TEST(TracedRenderer, edges_are_covered_in_eighths) {
  Scene scene;
  const auto frame = scene.trace();
  ASSERT_TRUE(frame);
  int partly = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const float covered = at(*frame, x, y).object.w;
      partly += covered > 0.1f && covered < 0.9f;
      ASSERT_LE(covered, 1.0f + 1e-5f);
    }
  EXPECT_GT(partly, 50);
}

TEST(OpenSky, many_points_at_once_agree_with_one_by_one) {
  Scene scene;
  for (Aperture& a : scene.windows)
    a.refractive_index = 1.52f;
  const auto pyramid = sky_map_pyramid(scene.sky);
  const auto cells = aperture_cells(scene.windows, scene.object.bounds(), pyramid);
  const auto many = open_sky_irradiance(pyramid, cells, scene.object.positions, scene.object.normals);
  float brightest = 0.0f;
  for (const Rgb& e : many)
    brightest = std::max(brightest, e.g);
  for (std::size_t i = 0; i < many.size(); i += 37) {
    const Rgb one = open_sky_irradiance(pyramid, cells, scene.object.positions[i], glm::dvec3(scene.object.normals[i]));
    ASSERT_NEAR(many[i].g, one.g, 1e-4f * brightest) << i;
  }
}

/// Whether a facet in the plane z = 0 shows its back to an eye far away: `cosine` of the angle from +z. One corner's
/// normal is turned by `turn` radians towards that eye.
bool shows_back(float cosine, float turn) {
  TracedScene scene;
  scene.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  scene.normals = {{std::sin(turn), 0, std::cos(turn)}, {0, 0, 1}, {0, 0, 1}};
  scene.triangles = {{0, 1, 2}};
  scene.sphere = {{0.3, 0.3, 0}, 1.0};
  ObjectHit hit;
  hit.triangle = 0;
  hit.u = hit.v = 0.3f;
  return object_surface(scene, {0.3f + 10.0f * std::sqrt(1.0f - cosine * cosine), 0.3f, 10.0f * cosine}, hit).back;
}

// At a silhouette the corners' normals are means with a facet that faces the eye.
TEST(ObjectSurface, a_facet_beside_a_silhouette_that_just_faces_away_is_still_the_front) {
  for (const float cosine : {1.0f, 0.1f, 0.0f, -0.05f})
    EXPECT_FALSE(shows_back(cosine, 0.05f)) << cosine;
  for (const float cosine : {-0.2f, -1.0f})
    EXPECT_TRUE(shows_back(cosine, 0.05f)) << cosine;
}

TEST(ObjectSurface, a_flat_sheet_shows_its_back_as_soon_as_it_faces_away) {
  for (const float cosine : {1.0f, 0.02f})
    EXPECT_FALSE(shows_back(cosine, 0.0f)) << cosine;
  for (const float cosine : {-0.02f, -0.05f, -0.2f})
    EXPECT_TRUE(shows_back(cosine, 0.0f)) << cosine;
}

} // namespace
} // namespace daylit
