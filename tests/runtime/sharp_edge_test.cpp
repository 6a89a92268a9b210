// Normals that run over a sharp edge: the sun lights no facet from below.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "torus_scene.h"

namespace daylit {
namespace {

using test::TorusScene;

constexpr float kDegree = std::numbers::pi_v<float> / 180.0f;

/// A strip as narrow as a bowl's rim, tilted away from the window by `tilt` degrees; all normals lean back towards it
/// by `lean` degrees.
ObjectMesh strip(float tilt, float lean) {
  const float t = kDegree * tilt, n = kDegree * (tilt - lean);
  const glm::vec3 along(0.15f, 0.0f, 0.0f), across(0.0f, 0.015f * std::cos(t), 0.015f * std::sin(t));
  ObjectMesh mesh;
  mesh.positions = {-along - across, along - across, along + across, -along + across};
  mesh.normals.assign(4, {0.0f, -std::sin(n), std::cos(n)});
  mesh.reflectance.assign(4, Rgb(0.5f));
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

/// Mean radiance over the whole pixels of the object.
double brightness(PictureRenderer& renderer, const ObjectMesh& mesh, const std::optional<DetectedSun>& sun) {
  TorusScene scene;
  scene.object = test::place(mesh, {2.0, 3.4, 0.23});
  scene.camera = test::look_at({2.0, 3.0, 0.9}, {2.0, 3.4, 0.23}, 128, 124, 0.4);
  scene.sun = sun;
  scene.samples = sun ? 64 : 48; // of which the sun has a quarter: the same of the sky
  const auto frame = scene.render(renderer);
  EXPECT_TRUE(frame);
  double sum = 0.0;
  int count = 0;
  for (int y = 0; frame && y < frame->height_px; ++y)
    for (int x = 0; x < frame->width_px; ++x)
      if (const glm::vec4 object = test::at(*frame, x, y).object; object.w > 0.999f) {
        sum += static_cast<double>(object.y);
        ++count;
      }
  EXPECT_GT(count, 100);
  return count > 0 ? sum / count : 0.0;
}

/// pi L / (rho E cos) of the sun, the cosine at the normals.
double sunlit_part(PictureRenderer& renderer, float tilt, float lean) {
  const DetectedSun sun = test::sun_through_the_window();
  const ObjectMesh mesh = strip(tilt, lean);
  const double cosine = glm::dot(sun.direction, glm::dvec3(mesh.normals[0]));
  const double without = brightness(renderer, mesh, std::nullopt);
  return (brightness(renderer, mesh, sun) - without) * std::numbers::pi /
         (0.5 * static_cast<double>(sun.normal_irradiance.y) * cosine);
}

// The sun stands 39 degrees high: below strips that are tilted by more.
TEST(SharpEdge, the_sun_lights_no_facet_from_below_by_rays) {
  const TorusScene scene;
  auto renderer = TracedRenderer::make(scene.room, scene.windows, {});
  ASSERT_TRUE(renderer);
  EXPECT_NEAR(sunlit_part(*renderer, 33.0f, 40.0f), 1.0, 0.05) << "the sun is above the facet";
  EXPECT_NEAR(sunlit_part(*renderer, 45.0f, 40.0f), 0.0, 0.02) << "below it";
  EXPECT_NEAR(sunlit_part(*renderer, 42.0f, 20.0f), 1.0, 0.06)
      << "below the facet of a smooth surface: 0.943 to 0.947 by 64 to 256 lights";
}

TEST(SharpEdge, the_sun_lights_no_facet_from_below_by_open_gl) {
  const TorusScene scene;
  auto context = create_gl_context();
  ASSERT_TRUE(context) << context.error().message();
  auto renderer = Renderer::make(std::move(*context), scene.room, scene.windows);
  ASSERT_TRUE(renderer) << renderer.error().message();
  EXPECT_GT(sunlit_part(*renderer, 33.0f, 40.0f), 0.85) << "a facet shadows itself a little in the map";
  EXPECT_NEAR(sunlit_part(*renderer, 40.0f, 40.0f), 0.0, 0.02);
}

} // namespace
} // namespace daylit
