#include <gtest/gtest.h>

#include <cstring>

#include "runtime/composite/compose.h"
#include "test_scene.h"

namespace daylit {
namespace {

struct Case {
  RenderCamera camera = test::look_at({2, 1, 1}, {2, 4, 1}, 4, 2, 0.8);
  RgbImage photo{4, 2, Rgb(0.5f, 0.25f, 0.125f)};
  RenderedFrame frame;
  RoomPoint point{Rgb(1.0f), Rgb(3.0f), Rgb(10.0f), Rgb(0.5f)};

  Case() {
    frame.start(4, 2, {0, 0, 4, 2});
    for (DrawnPixel& p : frame.show(0, 0))
      p = {glm::vec4(0.0f), glm::vec4(0, 0, 0, 1), glm::vec2(1, 0), Rgb(0.0f), kUnknownTriangle};
  }
  Composite run(const ComposeSettings& settings = {}) const {
    return compose(
        photo, frame, camera, [&](const glm::dvec3&, std::uint32_t) { return std::optional(point); }, settings);
  }
};

TEST(Compose, an_untouched_picture_is_bit_identical) {
  Case c;
  c.photo.at(1, 1) = Rgb(-0.0f, 1e-42f, std::numeric_limits<float>::infinity());
  const Composite result = c.run();
  EXPECT_EQ(0, std::memcmp(result.picture.texels.data(), c.photo.texels.data(), 8 * sizeof(Rgb)));
  EXPECT_EQ(result.object_pixels + result.shadow_pixels, 0u);
}

TEST(Compose, the_ratio_is_light_with_over_light_without_the_object) {
  Case c;
  c.frame.at(1, 1).lost_sky = glm::vec4(0.5f, 0.25f, 0.0f, 1.0f);
  c.frame.at(1, 1).received = glm::vec2(0.8f, 0.1f);
  c.frame.at(1, 1).lost_sun = Rgb(0.05f);
  // Without: 3 x 0.8 + 10 x 0.1 + 1 = 4.4; lost: 3 x (0.5, 0.25, 0) + 10 x 0.05.
  const Rgb expected = c.photo.at(1, 1) * (Rgb(4.4f) - Rgb(2.0f, 1.25f, 0.5f)) / 4.4f;
  const Composite result = c.run();
  for (int k = 0; k < 3; ++k)
    EXPECT_NEAR(result.picture.at(1, 1)[k], expected[k], 1e-6f);
  EXPECT_EQ(result.shadow_pixels, 1u);
  EXPECT_EQ(result.touched[5], 1);
}

TEST(Compose, the_difference_takes_reflected_radiance_through_scale_and_colours) {
  Case c;
  c.frame.at(0, 0).lost_sky = glm::vec4(0.1f, 0.1f, 0.1f, 1.0f);
  ComposeSettings settings{{2.0, glm::dmat3(1.0)}, ShadowMode::difference};
  settings.photo.colour_matrix[0][0] = 0.5; // red of the picture from red of the scene
  const float change = 0.5f * 0.3f / std::numbers::pi_v<float>;
  const Composite result = c.run(settings);
  EXPECT_NEAR(result.picture.at(0, 0).r, 0.5f - change, 1e-6f);
  EXPECT_NEAR(result.picture.at(0, 0).b, 0.125f - 2.0f * change, 1e-6f);
}

TEST(Compose, a_change_below_half_a_code_value_is_not_written) {
  Case c;
  c.frame.at(2, 0).lost_sky = glm::vec4(glm::vec3(4.0f / 3.0f * 0.9f / 510.0f), 1.0f);
  EXPECT_EQ(c.run().shadow_pixels, 0u);
  c.frame.at(2, 0).lost_sky = glm::vec4(glm::vec3(4.0f / 3.0f * 1.2f / 510.0f), 1.0f);
  EXPECT_EQ(c.run().shadow_pixels, 1u);
}

TEST(Compose, object_edges_blend_by_coverage) {
  Case c;
  c.frame.at(3, 0).object = glm::vec4(0.6f, 0.6f, 0.6f, 0.25f); // radiance 2.4, a quarter covered
  c.frame.at(3, 0).lost_sky = glm::vec4(0, 0, 0, 0.75f);
  const Composite result = c.run();
  EXPECT_NEAR(result.picture.at(3, 0).r, 0.75f * 0.5f + 0.6f, 1e-6f);
  EXPECT_EQ(result.touched[3], 2);
}

TEST(Compose, no_light_anywhere_changes_nothing_and_makes_no_nan) {
  Case c;
  c.point = {Rgb(0.0f), Rgb(0.0f), Rgb(0.0f), Rgb(0.5f)};
  c.frame.at(0, 1).lost_sky = glm::vec4(1.0f, 1.0f, 1.0f, 1.0f);
  c.photo.at(0, 1) = Rgb(0.0f);
  const Composite result = c.run();
  EXPECT_EQ(result.shadow_pixels, 0u);
  for (const Rgb& t : result.picture.texels)
    EXPECT_TRUE(std::isfinite(t.r) && std::isfinite(t.g) && std::isfinite(t.b));
}

TEST(RenderCamera, a_distorted_lens_maps_each_pixel_to_the_pinhole_that_sees_the_same_ray) {
  LensModel lens = ideal_pinhole(64, 48, 0.9);
  lens.distortion = {-0.2, 0.05, 0, 0, 0, 0, 0, 0};
  const auto camera = make_render_camera(lens, glm::dmat4(1.0), 64, 48);
  ASSERT_TRUE(camera) << camera.error().message();
  EXPECT_GT(camera->width_px, 64);
  for (const glm::dvec2 p : {glm::dvec2(0, 0), glm::dvec2(63, 10), glm::dvec2(30, 24)}) {
    const glm::vec2 drawn = camera->drawn_position[static_cast<std::size_t>(p.y) * 64 + static_cast<std::size_t>(p.x)];
    EXPECT_GE(drawn.x, 0.0f);
    EXPECT_LT(glm::length(camera->direction(glm::dvec2(drawn)) - *lens.unproject(p)), 1e-5);
  }
}

TEST(RenderCamera, refuses_a_pose_that_is_no_motion_and_a_lens_of_another_shape) {
  const LensModel lens = ideal_pinhole(64, 48, 0.9);
  EXPECT_FALSE(make_render_camera(lens, glm::dmat4(2.0), 64, 48));
  EXPECT_FALSE(make_render_camera(lens, glm::dmat4(1.0), 64, 64));
  EXPECT_TRUE(make_render_camera(lens, glm::dmat4(1.0), 128, 96));
}

} // namespace
} // namespace daylit
