#pragma GCC diagnostic ignored "-Wdouble-promotion"
#include <chrono>
#include <cstdio>
#include <fstream>
#include <gtest/gtest.h>

#include "direct_reference.h"
#include "runtime/render/compose.h"
#include "test_scene.h"

namespace daylit {
namespace {

void write_pfm(const std::string& path, int w, int h, const std::vector<glm::vec4>& px) {
  std::ofstream f(path, std::ios::binary);
  f << "PF\n" << w << " " << h << "\n-1\n";
  for (int y = h - 1; y >= 0; --y)
    for (int x = 0; x < w; ++x)
      f.write(reinterpret_cast<const char*>(&px[y * w + x]), 12);
}

TEST(Renderer, explore) {
  const Room room = test::box_room();
  const auto window = test::box_window();
  const ObjectSurface object = test::place(test::torus(0.15f, 0.07f), {2.0, 2.6, 0.23}, 1.2);
  const BoundingSphere sphere = object.bounds();
  const SkyMap sky = test::overcast_sky();
  std::optional<DetectedSun> sun;
  if (getenv("SUN")) {
    sun.emplace();
    sun->direction = glm::normalize(glm::dvec3(0.1, 1.6, 1.0));
    sun->normal_irradiance = Rgb(10.0f);
  }
  const int M = getenv("M") ? atoi(getenv("M")) : 64;
  const LightSet lights = sample_lights(sky, sun, window, sphere, M);
  const auto pyramid = sky_map_pyramid(sky);
  const auto cells = aperture_cells(window, sphere, pyramid);
  std::printf("lights %zu + %zu cells %zu\n", lights.sky.size(), lights.sun.size(), cells.size());
  RenderSettings settings;
  if (getenv("MAP"))
    settings.sky_map_texels = atoi(getenv("MAP"));
  if (getenv("COV"))
    settings.coverage_samples = atoi(getenv("COV"));
  auto context = create_gl_context();
  ASSERT_TRUE(context) << context.error().message();
  auto renderer = Renderer::make(std::move(*context), room, window, settings);
  ASSERT_TRUE(renderer) << renderer.error().message();
  std::printf("%s occluders %zu\n", renderer->description().c_str(), renderer->room_occluders());
  const RenderCamera camera = test::look_at({3.2, 1.2, 1.1}, {2.0, 2.6, 0.2}, 512, 496, 0.6);
  ASSERT_TRUE(renderer->set_camera(camera));
  ASSERT_TRUE(renderer->set_objects(object));
  ASSERT_TRUE(renderer->set_lights(lights));
  auto t0 = std::chrono::steady_clock::now();
  const auto open = open_sky_irradiance(pyramid, cells, object.positions, object.normals);
  std::printf("open %.2f ms for %zu\n",
              1e3 * std::chrono::duration<double>(std::chrono::steady_clock::now() - t0).count(), open.size());
  ASSERT_TRUE(renderer->set_vertex_light(std::vector<Rgb>(open.size(), Rgb(0)), open));
  for (int k = 0; k < 3; ++k) {
    auto f = renderer->draw();
    ASSERT_TRUE(f) << f.error().message();
    const auto& t = renderer->times();
    std::printf("shadow %.1f picture %.1f read %.1f ms\n", t.shadow_maps_ms, t.picture_ms, t.read_back_ms);
  }
  if (getenv("QUICK"))
    return;
  const auto frame = renderer->draw();
  write_pfm(DAYLIT_BINARY_DIR "/object.pfm", 512, 496, frame->object);
  write_pfm(DAYLIT_BINARY_DIR "/lost.pfm", 512, 496, frame->lost_sky);

  // twin
  const test::DirectReference reference(room, window, object);
  const RayScene object_rays = *RayScene::build(object.positions, object.triangles);
  const RayScene room_rays = *RayScene::build(room);
  std::vector<Aperture> w2 = window;
  std::vector<ApertureCell> fine;
  for (int i = 0; i < 64; ++i)
    for (int j = 0; j < 48; ++j)
      fine.push_back(
          {{1.2 + 1.6 * (i + .5) / 64, 5, 0.9 + 1.2 * (j + .5) / 48}, {0, -1, 0}, 1.6 * 1.2 / 64 / 48, 1, Rgb(1)});
  double gt2 = 0, gx2 = 0, tx2 = 0, mx = 0, n = 0, ob = 0, lt2 = 0, lx2 = 0, lm = 0, lref = 0;
  std::vector<glm::vec4> err(frame->object.size(), glm::vec4(0)), ltruth = err;
  for (int y = 0; y < 496; y += 5)
    for (int x = 0; x < 512; x += 5) {
      const std::size_t i = y * 512 + x;
      const glm::dvec3 d = camera.direction({x, y});
      RayHit hit;
      if (frame->object[i].w > 0.999f &&
          object_rays.closest(object_rays.to_local(camera.eye()), glm::vec3(d), 0, 100, hit)) {
        const auto& t = object.triangles[hit.triangle];
        const glm::dvec3 p = camera.eye() + d * double(hit.distance);
        const glm::dvec3 nn = glm::normalize(glm::dvec3(object.normals[t[0]] * (1 - hit.u - hit.v) +
                                                        object.normals[t[1]] * hit.u + object.normals[t[2]] * hit.v));
        const Rgb e = reference.estimate(lights, pyramid, cells, p, nn).with;
        const Rgb exact = reference.exact(pyramid, fine, lights.sun, p, nn).with;
        const double g = frame->object[i].y / 0.5 * 3.14159265, ee = e.y, x2 = exact.y;
        gt2 += (g - ee) * (g - ee);
        gx2 += (g - x2) * (g - x2);
        tx2 += (ee - x2) * (ee - x2);
        mx += x2;
        ob += g - x2;
        n++;
        err[i] = glm::vec4(g - x2, x2, ee, 0);
      } else if (frame->lost_sky[i].w > 0.999f &&
                 room_rays.closest(room_rays.to_local(camera.eye()), glm::vec3(d), 0, 100, hit)) {
        const glm::dvec3 p = camera.eye() + d * double(hit.distance);
        glm::dvec3 nn = glm::normalize(area_normal(room, room.triangles[hit.triangle]));
        if (glm::dot(nn, d) > 0)
          nn = -nn;
        const auto e = reference.estimate(lights, pyramid, cells, p, nn);
        const auto exact = reference.exact(pyramid, fine, lights.sun, p, nn);
        const double g = frame->lost_sky[i].y * open_sky_irradiance(pyramid, cells, p, nn).y +
                         (sun ? frame->room[i].z * sun->normal_irradiance.y : 0),
                     ee = e.without.y - e.with.y, x2 = exact.without.y - exact.with.y;
        ltruth[i] = glm::vec4(g, ee, x2, 0);
        if (x2 > 0.02 * exact.without.y) {
          lt2 += (g - ee) * (g - ee);
          lx2 += (g - x2) * (g - x2);
          lref += exact.without.y;
          lm++;
        }
      }
    }
  mx /= n;
  std::printf("object: mean %.4f  GL-twin %.2f%%  GL-exact %.2f%%  twin-exact %.2f%%  bias %.2f%% n=%g\n", mx,
              100 * std::sqrt(gt2 / n) / mx, 100 * std::sqrt(gx2 / n) / mx, 100 * std::sqrt(tx2 / n) / mx,
              100 * ob / n / mx, n);
  std::printf("shadow: GL-twin %.2f%%  GL-exact %.2f%% of without n=%g\n", 100 * std::sqrt(lt2 / lm) / (lref / lm),
              100 * std::sqrt(lx2 / lm) / (lref / lm), lm);
  write_pfm(DAYLIT_BINARY_DIR "/err.pfm", 512, 496, err);
}

} // namespace
} // namespace daylit
