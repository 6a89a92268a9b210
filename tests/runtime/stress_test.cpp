// Where there is nothing sensible to draw, and where there is a great deal: by both renderers (the table in
// runtime/README.md).

#include <gtest/gtest.h>

#include "runtime/object/relight.h"
#include "test_session.h"

namespace daylit {
namespace {

using test::is_sound;
using test::Studio;
using test::warns;

class Stress : public testing::TestWithParam<Backend> {
protected:
  /// A frame of the studio that must be sound.
  Frame sound_frame(const Studio& studio) {
    const auto frame = studio.render(GetParam());
    EXPECT_TRUE(frame) << frame.error().message();
    if (!frame)
      return {};
    EXPECT_TRUE(is_sound(frame->composite, studio.photo));
    return *frame;
  }
};

TEST_P(Stress, an_ordinary_frame_warns_of_nothing_and_leaves_the_rest_untouched) {
  Studio studio;
  const Frame frame = sound_frame(studio);
  EXPECT_GT(frame.composite.object_pixels, 280u);
  EXPECT_GT(frame.composite.shadow_pixels, 100u);
  EXPECT_LT(frame.composite.object_pixels + frame.composite.shadow_pixels, studio.photo.texels.size() * 3 / 4);
  EXPECT_TRUE(frame.report.warnings.empty()) << frame.report.warnings[0];
}

TEST_P(Stress, half_outside_the_room_takes_the_light_of_the_half_inside) {
  Studio studio;
  studio.config.objects[0].position = {4.0, 3.0, 1.0}; // the wall x = 4 cuts it
  studio.config.world_from_camera = look_at({2.0, 3.0, 1.2}, {4.0, 3.0, 1.0});
  const Frame frame = sound_frame(studio);
  EXPECT_GT(frame.composite.object_pixels, 50u);
  EXPECT_TRUE(warns(frame, "take the indirect light of their neighbours"));
}

TEST_P(Stress, inside_a_wall_it_is_hidden) {
  Studio studio;
  studio.config.objects[0].position = {4.3, 3.0, 1.0};
  studio.config.world_from_camera = look_at({2.0, 3.0, 1.2}, {4.0, 3.0, 1.0});
  const Frame frame = sound_frame(studio);
  EXPECT_EQ(frame.composite.object_pixels, 0u);
  EXPECT_TRUE(warns(frame, "no indirect light"));
  EXPECT_TRUE(warns(frame, "no pixel shows an object"));
}

TEST_P(Stress, outside_every_probe_far_away_nothing_is_touched) {
  Studio studio;
  studio.config.objects[0].position = {40.0, 3.0, 1.0};
  const Frame frame = sound_frame(studio);
  EXPECT_EQ(frame.composite.object_pixels + frame.composite.shadow_pixels, 0u);
  EXPECT_TRUE(warns(frame, "no indirect light"));
}

TEST_P(Stress, before_the_near_plane_it_is_cut) {
  Studio studio;
  studio.config.objects[0].position = {3.0, 4.6, 1.1}; // around the camera
  studio.config.objects[0].scale = 0.5;
  const Frame frame = sound_frame(studio);
  EXPECT_TRUE(warns(frame, "the camera stands among the objects"));
}

TEST_P(Stress, a_black_sky_draws_a_black_object_and_no_shadow) {
  Studio studio;
  std::fill(studio.sky.radiance.begin(), studio.sky.radiance.end(), Rgb(0.0f));
  const Frame frame = sound_frame(studio);
  EXPECT_EQ(frame.composite.shadow_pixels, 0u);
  EXPECT_GT(frame.composite.object_pixels, 280u);
  EXPECT_TRUE(warns(frame, "the sky is black"));
}

TEST_P(Stress, one_pixel_of_1e9_is_taken_as_it_is) {
  Studio studio;
  const int height = studio.sky.height;
  studio.sky.radiance[static_cast<std::size_t>(height / 4) * studio.sky.width + studio.sky.width / 4] = Rgb(1e9f);
  const Frame frame = sound_frame(studio);
  EXPECT_GT(frame.composite.object_pixels, 280u);
}

TEST_P(Stress, no_window_in_view_leaves_indirect_light) {
  Studio studio(std::vector<Aperture>{});
  const Frame frame = sound_frame(studio);
  EXPECT_GT(frame.composite.object_pixels, 280u);
  EXPECT_TRUE(warns(frame, "no window lets light through"));
  EXPECT_EQ(frame.report.sky_lights, 0u);
}

TEST_P(Stress, no_triangles_are_an_error_that_names_the_file) {
  Studio studio;
  test::write_ply(studio.config.objects[0].model, {});
  const auto session = studio.open(GetParam());
  ASSERT_FALSE(session);
  EXPECT_NE(session.error().message().find("ring.ply"), std::string::npos) << session.error().message();
  EXPECT_NE(session.error().message().find("no triangle"), std::string::npos) << session.error().message();
}

TEST_P(Stress, a_million_triangles_are_drawn) {
  // The renderers alone: transfer vectors of such a mesh are minutes of work, once.
  const ObjectSurface object = test::place(test::torus(0.15f, 0.07f, 1000, 500), {2.0, 3.4, 0.23}, 1.2);
  ASSERT_EQ(object.triangles.size(), 1'000'000u);
  auto renderer = choose_renderer(GetParam(), test::box_room(), test::box_window());
  ASSERT_TRUE(renderer) << renderer.error().message();
  const auto pyramid = sky_map_pyramid(test::overcast_sky(64));
  const LightSet lights = sample_lights(pyramid[0], {}, test::box_window(), object.bounds(), 2);
  std::vector<VertexLight> light(object.positions.size());
  for (VertexLight& l : light)
    l.open_sky_front = Rgb(1.0f);
  RenderedFrame frame;
  const RenderCamera camera = test::look_at({3.0, 4.6, 1.1}, {2.0, 3.4, 0.2}, 96, 92, 0.6);
  PictureRenderer& r = **renderer;
  for (const auto& step : {r.set_camera(camera), r.set_objects(object), r.set_lights(lights),
                           r.set_vertex_light(every_vertex(light.size()), light), r.draw(frame)})
    ASSERT_TRUE(step) << step.error().message();
  std::size_t covered = 0;
  for (int y = 0; y < frame.height_px; ++y)
    for (int x = 0; x < frame.width_px; ++x)
      if (frame.shown(x, y)) {
        const glm::vec4& p = frame.at(x, y).object;
        ASSERT_TRUE(std::isfinite(p.x) && std::isfinite(p.w));
        covered += p.w > 0.999f;
      }
  EXPECT_GT(covered, 500u);
}

INSTANTIATE_TEST_SUITE_P(Renderers, Stress, testing::Values(Backend::rays, Backend::opengl),
                         [](const auto& p) { return p.param == Backend::rays ? "rays" : "gl"; });

TEST(VertexProbes, an_object_sunk_into_the_floor_keeps_its_light_at_the_bottom) {
  // A strip of four vertices, the last two below the floor.
  const std::vector<std::array<std::uint32_t, 3>> strip{{0, 1, 2}, {1, 2, 3}};
  std::vector<VertexProbes> probes(4);
  probes[0].count = probes[1].count = 1;
  probes[0].weight[0] = probes[1].weight[0] = 1.0f;
  probes[1].probe[0] = 7;
  EXPECT_EQ(spread_vertex_probes(strip, probes), 2u);
  EXPECT_EQ(probes[2].count, 1);
  EXPECT_EQ(probes[3].probe[0], 7u) << "of the nearest along the mesh";
  std::vector<VertexProbes> none(4);
  EXPECT_EQ(spread_vertex_probes(strip, none), 4u);
}

} // namespace
} // namespace daylit
