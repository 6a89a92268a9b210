#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>

#include <gtest/gtest.h>

#include "test_session.h"

namespace daylit {
namespace {

using test::Studio;

int times_told(const FrameReport& report, const std::string& stage) {
  return static_cast<int>(
      std::ranges::count_if(report.stage_ms, [&](const auto& told) { return told.first == stage; }));
}

TEST(Session, a_sky_measured_beforehand_gives_the_same_frame) {
  const Studio studio;
  auto beforehand = studio.open(Backend::rays), within = studio.open(Backend::rays);
  ASSERT_TRUE(beforehand && within);
  SkyMap brighter = studio.sky;
  for (Rgb& c : brighter.radiance)
    c *= 2.0f;
  for (const SkyMap& sky : {studio.sky, brighter}) {
    const auto image = test::sky_image(sky);
    ASSERT_TRUE(image);
    beforehand->measure_sky(*image);
    const auto a = beforehand->render({*image, studio.photo}), b = within->render({*image, studio.photo});
    ASSERT_TRUE(a && b);
    EXPECT_FALSE((*a)->report.reused.sky);
    EXPECT_EQ(times_told((*a)->report, "sky"), 1);
    EXPECT_EQ((*a)->composite.picture.texels, (*b)->composite.picture.texels);
    EXPECT_GT((*a)->composite.object_pixels, 0u);
    beforehand->measure_sky(*image);
    const auto again = beforehand->render({*image, studio.photo});
    ASSERT_TRUE(again);
    EXPECT_TRUE((*again)->report.reused.sky);
    EXPECT_EQ(times_told((*again)->report, "sky"), 0);
  }
}

/// In the order of the stages.
std::array<bool, 6> reused(const Frame& frame) {
  const Reused& r = frame.report.reused;
  return {r.sky, r.samples, r.probes, r.object_light, r.drawn, r.picture};
}

TEST(Session, a_change_renews_what_follows_from_it_and_nothing_else) {
  Studio studio;
  auto session = studio.open(Backend::rays);
  ASSERT_TRUE(session);
  const auto frame = [&] { return reused(*studio.render(*session)); };
  using Stages = std::array<bool, 6>;
  EXPECT_EQ(frame(), (Stages{false, false, false, false, false, false}));
  EXPECT_EQ(reused(**session->render({*test::sky_image(studio.sky), studio.photo, 7, 7}))[0], false) << "another id";
  const auto sky = test::sky_image(studio.sky);
  const auto next = [&] { return reused(**session->render({*sky, studio.photo, 7, 7})); };
  (void)next();
  EXPECT_EQ(next(), (Stages{true, true, true, true, true, true}));
  session->set_light_samples(24);
  EXPECT_EQ(next(), (Stages{true, false, true, false, false, false}));
  ASSERT_TRUE(session->set_pose(daylit::look_at({3.0, 4.5, 1.1}, {2.0, 3.4, 0.2})));
  EXPECT_EQ(next(), (Stages{true, true, true, false, false, false}));
  session->show({true, false, true});
  EXPECT_EQ(next(), (Stages{true, true, true, false, false, false}));
  studio.config.objects[0].position.x += 0.01;
  ASSERT_TRUE(session->set_placement(0, studio.config.objects[0]));
  EXPECT_EQ(next(), (Stages{true, false, false, false, false, false}));
  EXPECT_EQ(reused(**session->render({*sky, studio.photo, 7, 8})), (Stages{true, true, true, true, true, false}));
  EXPECT_EQ(reused(**session->render({*sky, studio.photo, 8, 8})), (Stages{false, false, true, false, false, false}));
  ASSERT_TRUE(session->recreate_renderer());
  EXPECT_EQ(reused(**session->render({*sky, studio.photo, 8, 8})), (Stages{true, true, true, false, false, false}));
}

/// Drawn by a session that was opened, and has drawn, with other placements, cameras, skies and parts of the light.
Frame frame_after_changes(Studio& studio, bool another_sky) {
  const SkyMap last_sky = studio.sky;
  const RunConfig last = studio.config;
  studio.config.objects[1].position.y -= 0.1;
  studio.config.world_from_camera = daylit::look_at({2.8, 4.7, 1.2}, {2.1, 3.4, 0.2});
  auto session = *studio.open(Backend::rays);
  for (int step = 0; step < 4; ++step) { // each followed by a frame, whose values must not stay
    if (step == 1 && another_sky)
      for (Rgb& c : studio.sky.radiance)
        c *= Rgb(3.0f, 2.0f, 0.5f);
    if (step == 2)
      studio.config.objects[1].position.x += 0.1;
    if (step == 3) {
      studio.config = last;
      studio.sky = last_sky;
    }
    session.show({step != 2, true, true});
    EXPECT_TRUE(session.set_placement(1, studio.config.objects[1]));
    EXPECT_TRUE(session.set_pose(*studio.config.world_from_camera));
    EXPECT_TRUE(studio.render(session));
  }
  return *studio.render(session);
}

TEST(Session, after_many_changes_a_frame_is_that_of_a_new_session) {
  Studio studio;
  ObjectConfig second = studio.config.objects[0];
  second.position.x += 0.4; // so near that the two exchange light
  studio.config.objects.push_back(second);
  const Frame fresh = *studio.render(Backend::rays);
  EXPECT_GT(fresh.composite.object_pixels, 200u);
  EXPECT_EQ(frame_after_changes(studio, false).composite.picture.texels, fresh.composite.picture.texels);
  // Under another sky the light field is changed by steps, with rounding errors of single precision.
  const Frame kept = frame_after_changes(studio, true);
  EXPECT_EQ(kept.composite.touched, fresh.composite.touched);
  for (std::size_t i = 0; i < studio.photo.texels.size(); ++i)
    for (int c = 0; c < 3; ++c)
      ASSERT_NEAR(kept.composite.picture.texels[i][c], fresh.composite.picture.texels[i][c], 1e-5f) << i;
}

TEST(Session, an_object_is_picked_by_its_mesh_and_not_through_a_wall) {
  const Studio studio; // a ring of radius 0.15 m around a hole of 0.08 m, its axis turned by 70 degrees about x
  auto session = studio.open(Backend::rays);
  ASSERT_TRUE(session) << session.error().message();
  const glm::dvec3 centre(2.0, 3.4, 0.23), axis(0.0, -std::sin(1.2217305), std::cos(1.2217305));
  const auto shown = [&](const glm::dvec3& at) { return session->object_at(at + axis, -axis); };
  EXPECT_EQ(shown(centre), std::nullopt) << "through the hole";
  EXPECT_EQ(shown(centre + glm::dvec3(0.15, 0, 0)), 0u);
  EXPECT_EQ(shown(centre + glm::dvec3(0.3, 0, 0)), std::nullopt) << "beside it";
  EXPECT_EQ(session->object_at({2.15, 3.4, -1.0}, {0, 0, 1}), std::nullopt) << "below the floor";
}

TEST(Session, an_object_with_on_is_set_down_wherever_it_goes) {
  Studio studio;
  studio.config.objects[0].on = StandsOn{"", true};
  studio.config.objects[0].position.z = 77.0; // does not count
  auto session = studio.open(Backend::rays);
  ASSERT_TRUE(session) << session.error().message();
  const double height = 0.15 * std::sin(1.2217305) + 0.07; // of the ring's middle above its lowest point
  EXPECT_NEAR(session->placements()[0].position.z, height, 2e-3);
  ObjectConfig moved = session->placements()[0];
  moved.position = {1.0, 1.0, 5.0};
  ASSERT_TRUE(session->set_placement(0, moved));
  EXPECT_NEAR(session->placements()[0].position.z, height, 2e-3);
  moved.position.x = 40.0; // outside
  EXPECT_FALSE(session->set_placement(0, moved));
  EXPECT_EQ(session->placements()[0].position.x, 1.0) << "it stays where it was";
}

/// A cube in the place of the ring, that shines in green.
void put_lamp(Studio& studio, double green) {
  std::ofstream(studio.folder / "lamp.mtl") << "newmtl lamp\nKd 0.3 0.3 0.3\nKe 0 " << green << " 0\n";
  std::ofstream(studio.folder / "lamp.obj")
      << "mtllib lamp.mtl\nv 0 0 0\nv .2 0 0\nv .2 .2 0\nv 0 .2 0\nv 0 0 .2\nv .2 0 .2\nv .2 .2 .2\nv 0 .2 .2\n"
         "usemtl lamp\nf 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
  ObjectConfig& object = studio.config.objects[0];
  object.model = studio.folder / "lamp.obj";
  object.position = {1.9, 3.3, 0.02};
  object.rotation_deg = {0.0, 0.0, 0.0};
}

TEST(Session, an_object_that_shines_lights_the_room_around_it_in_its_colour) {
  Studio studio;
  put_lamp(studio, 0.0);
  const auto off = studio.render(Backend::rays);
  put_lamp(studio, 5.0);
  const auto on = studio.render(Backend::rays);
  ASSERT_TRUE(off && on);
  Rgb gain(0.0f);
  for (std::size_t i = 0; i < studio.photo.texels.size(); ++i)
    if (off->composite.coverage[i] == 0.0f)
      gain += on->composite.picture.texels[i] - off->composite.picture.texels[i];
  EXPECT_GT(gain.g, 1.0f);
  EXPECT_LT(std::fabs(gain.r), 0.01f * gain.g) << "only green light is added";
  EXPECT_TRUE(test::is_sound(on->composite, studio.photo));
}

TEST(Session, objects_that_come_and_go_leave_the_frame_of_a_new_session) {
  Studio studio;
  const auto one = studio.config.objects;
  auto two = one;
  two.push_back(one[0]);
  two[1].position.x += 0.4;
  auto session = *studio.open(Backend::rays);
  const auto load = [&](const std::vector<ObjectConfig>& objects) {
    return *load_virtual_objects(objects, studio.folder, [](const std::string&, double) { return true; });
  };
  const Frame first = *studio.render(session);
  for (const auto& objects : {two, one, {}, two}) {
    ASSERT_TRUE(session.set_objects(load(objects), objects));
    const auto frame = studio.render(session);
    ASSERT_TRUE(frame) << frame.error().message();
    studio.config.objects = objects;
    EXPECT_EQ(frame->composite.picture.texels, studio.render(Backend::rays)->composite.picture.texels)
        << objects.size();
  }
  ASSERT_TRUE(session.set_objects(load(one), one));
  EXPECT_EQ(studio.render(session)->composite.picture.texels, first.composite.picture.texels);
}

TEST(Session, objects_of_one_file_and_material_share_their_mesh) {
  const Studio studio;
  std::vector<ObjectConfig> objects(3, studio.config.objects[0]);
  objects[1].position.x += 0.4;
  objects[1].scale *= 0.5;
  objects[2].material = "chrome";
  const auto loaded = load_virtual_objects(objects, studio.folder, [](const std::string&, double) { return true; });
  ASSERT_TRUE(loaded) << loaded.error().message();
  const auto& parts = loaded->parts;
  EXPECT_EQ(parts[0].model, parts[1].model);
  EXPECT_NE(parts[0].model, parts[2].model) << "of another material";
  EXPECT_NEAR(loaded->bounds(1).radius, 0.5 * loaded->bounds(0).radius, 1e-6);
}

TEST(Session, a_dense_object_is_drawn_as_a_coarse_one_of_the_same_shape) {
  const auto drawn = [](int around, int across) {
    const Studio studio;
    test::write_ply(studio.config.objects[0].model, test::torus(0.15f, 0.07f, around, across));
    return *studio.render(Backend::rays);
  };
  const Frame coarse = drawn(160, 80), dense = drawn(240, 120);
  double square = 0.0, mean = 0.0, count = 0.0;
  for (std::size_t i = 0; i < coarse.composite.coverage.size(); ++i)
    if (coarse.composite.coverage[i] >= 1.0f && dense.composite.coverage[i] >= 1.0f) {
      const auto a = static_cast<double>(coarse.composite.picture.texels[i].g),
                 b = static_cast<double>(dense.composite.picture.texels[i].g);
      square += (a - b) * (a - b);
      mean += a;
      ++count;
    }
  ASSERT_GT(count, 100.0);
  EXPECT_LT(std::sqrt(square / count) / (mean / count), 0.02);
}

/// The studio's depth picture: of its room, or everywhere so near.
DepthPicture depth_of(const Studio& studio, float everywhere_m = 0.0f) {
  DepthPicture depth{Studio::kWidth, Studio::kHeight, std::vector<float>(studio.photo.texels.size(), everywhere_m)};
  const RayScene rays = *RayScene::build(test::box_room());
  const auto camera = *make_render_camera(ideal_pinhole(Studio::kWidth, Studio::kHeight, 0.6),
                                          *studio.config.world_from_camera, Studio::kWidth, Studio::kHeight);
  for (int y = 0; y < depth.height && everywhere_m == 0.0f; ++y)
    for (int x = 0; x < depth.width; ++x) {
      const glm::dvec3 direction = camera.direction(glm::dvec2(x, y));
      RayHit hit;
      if (rays.closest(rays.to_local(camera.eye()), glm::vec3(direction), 0.0f, 100.0f, hit))
        depth.z_m[static_cast<std::size_t>(y * depth.width + x)] =
            hit.distance * static_cast<float>(glm::dot(direction, glm::dvec3(camera.world_from_camera[2])));
    }
  return depth;
}

Frame with_depth(const Studio& studio, Session& session, const DepthPicture& depth) {
  const auto sky = test::sky_image(studio.sky);
  const auto frame = session.render({*sky, studio.photo, 0, 0, &depth});
  EXPECT_TRUE(frame);
  return **frame;
}

TEST(Session, a_depth_picture_of_what_the_model_holds_changes_no_bit) {
  const Studio studio;
  auto session = studio.open(Backend::rays);
  ASSERT_TRUE(session) << session.error().message();
  const Frame plain = *studio.render(*session), seen = with_depth(studio, *session, depth_of(studio));
  EXPECT_FALSE(seen.report.reused.picture) << "another depth picture, another frame";
  EXPECT_EQ(seen.report.thing_pixels, 0u);
  EXPECT_EQ(seen.composite.picture.texels, plain.composite.picture.texels);
  EXPECT_EQ(seen.composite.touched, plain.composite.touched);
}

TEST(Session, a_real_thing_hides_the_object_and_takes_no_shadow_of_the_wall_behind_it) {
  const Studio studio;
  auto session = studio.open(Backend::rays);
  ASSERT_TRUE(session) << session.error().message();
  const Frame plain = *studio.render(*session);
  ASSERT_GT(plain.composite.object_pixels, 100u);
  ASSERT_GT(plain.composite.shadow_pixels, 100u);
  // A sheet 0.3 m before the camera; no light on it comes past the object.
  const Frame hidden = with_depth(studio, *session, depth_of(studio, 0.3f));
  EXPECT_EQ(hidden.composite.object_pixels, 0u);
  EXPECT_EQ(hidden.composite.picture.texels, studio.photo.texels);
  EXPECT_EQ(with_depth(studio, *session, depth_of(studio)).composite.picture.texels, plain.composite.picture.texels)
      << "and when it is gone all is as before";
}

TEST(Session, a_depth_picture_of_another_shape_is_refused) {
  const Studio studio;
  auto session = studio.open(Backend::rays);
  ASSERT_TRUE(session) << session.error().message();
  const DepthPicture wrong{Studio::kWidth, Studio::kHeight - 1, {}};
  const auto sky = test::sky_image(studio.sky);
  const auto frame = session->render({*sky, studio.photo, 0, 0, &wrong});
  ASSERT_FALSE(frame);
  EXPECT_NE(frame.error().message().find("72 x 68, the photograph 72 x 69"), std::string::npos)
      << frame.error().message();
}

} // namespace
} // namespace daylit
