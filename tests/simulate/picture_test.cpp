#include <cmath>
#include <numbers>
#include <random>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "scene/room/aperture.h"
#include "scene/room/room_formats.h"
#include "scene/sky/sky_image.h"
#include "simulate/contact_error.h"
#include "simulate/picture.h"
#include "simulate/picture_error.h"
#include "simulate/sample_scene.h"
#include "simulate/teapot.h"

namespace daylit {
namespace {

constexpr double kPi = std::numbers::pi;

Result<RoomFile> sample_room() {
  return parse_obj_room(sample_room_obj("room.mtl"), "room.obj",
                        [](const std::string&) -> Result<std::string> { return sample_room_mtl(); });
}

Result<TraceScene> sample_trace_scene(const std::string& name, const glm::dvec3& object_position) {
  const auto room = sample_room();
  if (!room)
    return room.error();
  const ObjectMesh teapot = tessellate_teapot(4, 0.25, Rgb(0.7f));
  ObjectConfig object;
  object.position = object_position;
  return TraceScene::of_room(room->room, SkyLight(sample_scene(name, 64, 62)->sky_model), &teapot,
                             object_transform(object));
}

TEST(SampleRoom, has_one_window_of_the_stated_size_and_is_tight) {
  const auto room = sample_room();
  ASSERT_TRUE(room) << room.error().message();
  const auto rays = RayScene::build(room->room);
  const auto apertures = find_apertures(room->room, *rays);
  ASSERT_TRUE(apertures) << apertures.error().message();
  ASSERT_EQ(apertures->list.size(), 1u);
  EXPECT_NEAR(apertures->report.hole_area_m2 + apertures->report.window_area_m2, 1.4 * 1.2, 1e-6);
  EXPECT_LT(glm::distance(apertures->list[0].inward, glm::dvec3(-1, 0, 0)), 1e-9);
  EXPECT_EQ(apertures->report.unexplained_escape, 0.0);
}

TEST(SampleRoom, sun_reaches_the_teapot_in_the_sun_scene_and_not_in_the_shade_scene) {
  const auto room = sample_room();
  const auto rays = RayScene::build(room->room);
  for (const char* name : {"sun", "shade"}) {
    const auto scene = sample_scene(name, 64, 62);
    ASSERT_TRUE(scene);
    for (const glm::dvec3 offset : {glm::dvec3(0.12, 0, 0.05), glm::dvec3(-0.12, 0, 0.05), glm::dvec3(0, 0, 0.12)})
      EXPECT_EQ(rays->occluded(rays->to_local(scene->run.objects[0].position + offset),
                               glm::vec3(scene->sky_model.sun->direction), 0.0f, 1e9f),
                std::string(name) == "shade");
  }
}

TEST(Teapot, is_closed_upwards_oriented_and_of_the_published_shape) {
  EXPECT_EQ(teapot_patches().size(), 32u);
  const ObjectMesh mesh = tessellate_teapot(8, 0.25, Rgb(0.7f));
  EXPECT_GT(mesh.triangles.size(), 3900u);
  EXPECT_LT(mesh.triangles.size(), 4100u);
  double volume = 0.0;
  Bounds box;
  for (const auto& t : mesh.triangles) {
    const glm::dvec3 a(mesh.positions[t[0]]), b(mesh.positions[t[1]]), c(mesh.positions[t[2]]);
    volume += glm::dot(a, glm::cross(b, c)) / 6.0;
    for (const std::uint32_t v : t)
      EXPECT_GT(glm::dot(glm::dvec3(mesh.normals[v]), glm::cross(b - a, c - a)), 0.0);
  }
  for (const glm::vec3& p : mesh.positions)
    box.include(glm::dvec3(p));
  EXPECT_GT(volume, 0.0);
  EXPECT_NEAR(box.size().x, 0.25, 1e-6);
  EXPECT_NEAR(box.min.z, 0.0, 1e-9);
  EXPECT_NEAR(box.size().z / box.size().x, 3.15 / 6.43, 0.01); // Newell's proportions
}

TEST(MarkerBoard, prints_the_dictionary_pattern) {
  const MarkerBoard board{glm::dmat4(1.0), 0.08, 0.02};
  const double cell = 0.01;
  const auto at = [&](int column, int row) {
    return board.reflectance({(column - 3.5) * cell, (3.5 - row) * cell, 0.0}).r;
  };
  EXPECT_FLOAT_EQ(at(0, 0), board.black_reflectance);  // border
  EXPECT_FLOAT_EQ(at(-1, 0), board.white_reflectance); // margin
  EXPECT_FLOAT_EQ(at(1, 1), board.white_reflectance);  // first bit of row 0b100110
  EXPECT_FLOAT_EQ(at(2, 1), board.black_reflectance);
  EXPECT_FLOAT_EQ(at(6, 2), board.white_reflectance); // last bit of 0b100101
}

TEST(InteriorPicture, room_picture_does_not_know_where_the_object_is) {
  const LensModel lens = ideal_pinhole(24, 20, 0.44);
  const glm::dmat4 pose = look_at({2.25, 2.72, 0.92}, {1.93, 1.90, 0.045});
  const PictureSettings settings{.samples = 16, .base_samples = 16, .seed = 3};
  const auto a = sample_trace_scene("sun", {1.9, 1.9, 0}), b = sample_trace_scene("sun", {0.4, 2.6, 0});
  ASSERT_TRUE(a && b);
  const auto pa = render_interior(*a, lens, pose, settings), pb = render_interior(*b, lens, pose, settings);
  ASSERT_TRUE(pa && pb);
  EXPECT_EQ(pa->room.texels, pb->room.texels);
  EXPECT_NE(pa->truth.texels, pb->truth.texels);
  std::size_t equal = 0; // an object that is out of sight and sheds no shadow here changes few paths
  for (std::size_t i = 0; i < pb->room.texels.size(); ++i)
    equal += pb->room.texels[i] == pb->truth.texels[i] ? 1 : 0;
  EXPECT_GT(equal, pb->room.texels.size() / 4);
}

TEST(InteriorPicture, same_seed_gives_the_same_bits_for_any_number_of_threads) {
  const LensModel lens = ideal_pinhole(16, 12, 0.44);
  const glm::dmat4 pose = look_at({2.25, 2.72, 0.92}, {1.93, 1.90, 0.045});
  const auto scene = sample_trace_scene("shade", {1.9, 1.9, 0});
  ASSERT_TRUE(scene);
  InteriorPictures runs[2];
  for (const std::size_t threads : {1, 2}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    runs[threads - 1] = *render_interior(*scene, lens, pose, {.samples = 64, .base_samples = 16, .seed = 5});
  }
  EXPECT_EQ(runs[0].truth.texels, runs[1].truth.texels);
  EXPECT_EQ(runs[0].room.texels, runs[1].room.texels);
}

TEST(SkyFrame, sum_over_pixels_holds_sky_and_sun) {
  const AnalyticSky sky(sample_scene("sun", 64, 62)->sky_model);
  const LensModel lens = ideal_fisheye(256, 248, 190.0 * kPi / 180.0);
  auto frame = render_sky_frame(sky, lens);
  ASSERT_TRUE(frame) << frame.error().message();
  SkyModel without = sky.model();
  without.sun->normal_irradiance = Rgb(0.0f);
  without.ground_albedo = -1.0f;
  without.ground_radiance = sky.ground_radiance();
  const auto background = render_sky_frame(AnalyticSky(without), lens);
  const auto image = SkyImage::make(*frame, FisheyeProjection{lens, 0.0}, {GroundFill::Kind::albedo, 0.2f});
  ASSERT_TRUE(image) << image.error().message();
  double sun = 0.0;
  for (std::size_t i = 0; i < frame->texels.size(); ++i)
    sun += static_cast<double>(frame->texels[i].g - background->texels[i].g) *
           static_cast<double>(image->solid_angle_sr()[i]);
  const SunDisc& disc = *sky.model().sun;
  const double expected = static_cast<double>(disc.radiance().g) * disc.solid_angle_sr();
  EXPECT_NEAR(sun / expected, 1.0, 1e-3);
  // What a program derives from the picture for the unseen ground is what lit the truth.
  EXPECT_NEAR(static_cast<double>(image->fill_radiance().g / sky.ground_radiance().g), 1.0, 5e-3);
}

TEST(ContactError, a_glow_beside_the_object_is_found_and_one_further_away_is_not) {
  RgbImage truth(60, 60, Rgb(2.0f)), coverage(60, 60);
  for (int y = 20; y < 40; ++y)
    for (int x = 20; x < 40; ++x)
      coverage.at(x, y) = Rgb(1.0f);
  RgbImage result = truth;
  for (int y = 0; y < 60; ++y)
    for (int x = 0; x < 60; ++x)
      if (coverage.at(x, y).r > 0.0f || x > 52)
        result.at(x, y) = Rgb(50.0f); // on the object, and far from it
  EXPECT_EQ(measure_contact(result, truth, coverage).relative_rms, 0.0) << "the object takes no part in the smoothing";
  EXPECT_EQ(measure_contact(result, truth, coverage).pixels, 4u * 4 * 20 + 4u * 10) << "sides, and corners in a disc";
  for (int y = 20; y < 40; ++y)
    for (int x = 40; x < 44; ++x)
      result.at(x, y) = Rgb(3.0f);
  const ContactError e = measure_contact(result, truth, coverage);
  EXPECT_NEAR(e.brightest, 0.5, 0.06);
  EXPECT_EQ(e.darkest, 0.0);
  EXPECT_GT(e.bias, 0.08);
  EXPECT_LT(e.bias, 0.125) << "a quarter of the band";
  EXPECT_GT(e.relative_rms, 0.15);
}

TEST(PictureError, the_truth_s_own_error_is_that_of_what_is_seen) {
  // Noise of 0.3 on a truth of 1 beside white: smoothing leaves 1 / (2 sqrt(pi) sigma) of it, white has none.
  PictureErrorInput in;
  in.room = RgbImage(80, 80, Rgb(4.0f)); // white is 5
  in.truth = in.room;
  in.coverage = RgbImage(80, 80, Rgb(1.0f));
  in.standard_error = RgbImage(80, 80, Rgb(0.3f));
  std::mt19937 rng(3);
  std::normal_distribution<float> noise(0.0f, 0.3f);
  in.result = in.truth;
  for (int y = 0; y < 80; ++y)
    for (int x = 0; x < 80; ++x) {
      in.truth.at(x, y) = in.result.at(x, y) = Rgb(x < 40 ? 1.0f : 50.0f);
      for (int c = 0; c < 3; ++c)
        in.truth.at(x, y)[c] += noise(rng);
    }
  const auto e = measure_picture_error(in);
  ASSERT_TRUE(e) << e.error().message();
  EXPECT_NEAR(e->seen.truth_standard_error, e->seen.relative_rms, 0.05 * e->seen.relative_rms);
  EXPECT_GT(e->object.truth_standard_error, 0.0);
  EXPECT_LT(e->seen.truth_standard_error, 0.06);
}

TEST(PictureError, uniform_gain_error_is_reported_as_such) {
  PictureErrorInput in;
  in.room = RgbImage(40, 40, Rgb(2.0f));
  in.truth = in.room;
  in.coverage = RgbImage(40, 40);
  for (int y = 10; y < 20; ++y)
    for (int x = 10; x < 20; ++x) {
      in.coverage.at(x, y) = Rgb(1.0f);
      in.truth.at(x, y) = Rgb(1.0f);
      in.truth.at(x, y + 15) = Rgb(1.5f); // shadow
    }
  in.result = in.truth;
  for (Rgb& c : in.result.texels)
    c *= 1.1f;
  const auto e = measure_picture_error(in);
  ASSERT_TRUE(e) << e.error().message();
  EXPECT_EQ(e->object.pixels, 36u); // 10 x 10 eroded by 2
  EXPECT_NEAR(e->object.relative_rms, 0.1, 1e-6);
  EXPECT_NEAR(e->object.bias, 0.1, 1e-6);
  EXPECT_NEAR(e->object.no_object_rms, 1.0, 1e-6);
  EXPECT_NEAR(e->shadow.relative_rms, 0.1, 0.02); // its rim holds pixels of the surroundings
  EXPECT_GE(e->shadow.pixels, 100u);
  EXPECT_FALSE(e->mask_iou);
  in.result_coverage = RgbImage(40, 40);
  for (int y = 10; y < 20; ++y)
    for (int x = 15; x < 25; ++x)
      in.result_coverage->at(x, y) = Rgb(1.0f);
  EXPECT_NEAR(*measure_picture_error(in)->mask_iou, 50.0 / 150.0, 1e-12);
  in.result = RgbImage(40, 39);
  EXPECT_FALSE(measure_picture_error(in));
}

TEST(PictureError, columns_of_parts_that_no_pixel_shows_are_empty) {
  PictureErrorInput in;
  in.result = in.truth = in.room = RgbImage(20, 20, Rgb(1.0f));
  in.coverage = RgbImage(20, 20);
  for (int x = 9; x < 12; ++x)
    in.coverage.at(x, 10) = Rgb(1.0f); // nothing is left of it after erosion, and it throws no shadow
  const auto e = measure_picture_error(in);
  ASSERT_TRUE(e) << e.error().message();
  const std::string text = to_text(*e), json = to_json(*e);
  EXPECT_NE(text.find("object          0        -        -            -          -\n"), std::string::npos) << text;
  EXPECT_NE(text.find("shadow          0        -        -            -          -\n"), std::string::npos) << text;
  EXPECT_NE(text.find("whole         400     0.00     0.00         0.00       0.00\n"), std::string::npos) << text;
  EXPECT_NE(json.find("\"object\":{\"pixels\":0,\"relative_rms\":null,\"bias\":null,"), std::string::npos) << json;
  in.truth = RgbImage(20, 20); // black: nothing can be said relative to it
  EXPECT_NE(to_text(*measure_picture_error(in)).find("contact         0        -        -\n"), std::string::npos);
}

TEST(PictureError, a_second_truth_takes_the_noise_of_both_out_of_the_error) {
  std::mt19937 random(5);
  std::normal_distribution<float> noise(0.0f, 0.1f);
  PictureErrorInput in;
  in.result = RgbImage(200, 200);
  in.truth = in.room = in.coverage = in.second_truth.emplace(200, 200);
  for (std::size_t i = 0; i < in.result.texels.size(); ++i) {
    in.result.texels[i] = Rgb(1.1f);
    in.truth.texels[i] = Rgb(1.0f + noise(random));
    in.second_truth->texels[i] = Rgb(1.0f + noise(random));
    in.coverage.texels[i] = Rgb(1.0f);
  }
  const auto e = measure_picture_error(in);
  ASSERT_TRUE(e) << e.error().message();
  EXPECT_NEAR(e->object.relative_rms, std::hypot(0.1, 0.1), 0.002);
  EXPECT_NEAR(*e->object.rms_without_noise, 0.1, 0.002);
  in.second_truth = in.truth;
  EXPECT_NEAR(*measure_picture_error(in)->object.rms_without_noise, e->object.relative_rms, 1e-9) << "the same noise";
  in.second_truth.reset();
  EXPECT_FALSE(measure_picture_error(in)->object.rms_without_noise);
}

/// Rows grow brighter; noise of either sign. The third is chosen where its own noise does not count.
TEST(PictureError, shaded_third_is_chosen_by_the_second_truth) {
  PictureErrorInput in;
  in.coverage = RgbImage(34, 34, Rgb(1.0f));
  in.room = RgbImage(34, 34, Rgb(2.0f));
  in.truth = in.result = in.second_truth.emplace(34, 34);
  for (int y = 0; y < 34; ++y)
    for (int x = 0; x < 34; ++x) {
      in.result.at(x, y) = Rgb(1.0f + 0.02f * static_cast<float>(y) + 0.0001f * static_cast<float>(x));
      in.truth.at(x, y) = in.result.at(x, y) + Rgb((x + y) % 2 ? 0.3f : -0.3f);
      in.second_truth->at(x, y) = in.result.at(x, y) + Rgb(x % 2 ? 0.3f : -0.3f);
    }
  const auto e = measure_picture_error(in);
  ASSERT_TRUE(e) << e.error().message();
  ASSERT_TRUE(e->shaded);
  EXPECT_EQ(e->shaded->pixels, 385u); // of 34 x 34
  EXPECT_NEAR(e->shaded->bias, 0.0, 0.02);
  in.second_truth = in.truth;
  EXPECT_GT(measure_picture_error(in)->shaded->bias, 0.1) << "its own noise would count";
  in.second_truth.reset();
  EXPECT_FALSE(measure_picture_error(in)->shaded);
}

} // namespace
} // namespace daylit
