// The picture of what an object changes: what is left out of it, and what is composed from it.

#include <gtest/gtest.h>

#include "runtime/composite/change_picture.h"
#include "runtime/composite/compose.h"
#include "runtime/sky/window_sampler.h"
#include "runtime/trace/traced_renderer.h"
#include "scene/lens/lens.h"
#include "surrounded.h"
#include "torus_scene.h"

namespace daylit {
namespace {

using test::Surrounded;

TEST(ChangePicture, what_is_left_out_is_bounded_and_the_rest_grows_smoothly) {
  float left_out = 0.0f, last = 0.0f;
  for (int k = 0; k <= 2000; ++k) {
    const float change = 1e-5f * static_cast<float>(k);
    const float drawn = change * ChangePicture::drawn_fraction(Rgb(0.5f * change, change, 0.0f), Rgb(1.0f));
    EXPECT_GE(drawn, last) << "a larger change is drawn larger";
    EXPECT_LT(drawn - last, 2.5e-5f) << "no step";
    EXPECT_FLOAT_EQ(drawn, change * ChangePicture::drawn_fraction(Rgb(-change, 0.0f, 0.0f), Rgb(1.0f)));
    left_out = std::max(left_out, change - drawn);
    last = drawn;
    if (change <= 0.5f * ChangePicture::kThreshold) {
      EXPECT_EQ(drawn, 0.0f);
    }
    if (change >= 1.5f * ChangePicture::kThreshold) {
      EXPECT_EQ(drawn, change);
    }
  }
  EXPECT_LT(left_out, ChangePicture::kThreshold * 2.0f / 3.0f);
  EXPECT_EQ(ChangePicture::drawn_fraction(Rgb(1e-9f), Rgb(0.0f)), 1.0f) << "where there was no light, any is a change";
  EXPECT_EQ(ChangePicture::drawn_fraction(Rgb(0.0f), Rgb(0.0f)), 0.0f);
}

TEST(ChangePicture, draws_the_whole_change_near_an_object_and_nothing_far_from_it) {
  Surrounded s(0.08f);
  s.set_walls(0.6f);
  s.place({2.0, 2.5, 0.09}, 8.0f);
  const auto camera =
      make_render_camera(ideal_pinhole(320, 320, 0.9), look_at({2.0, 2.4, 2.2}, {2.0, 2.5, 0.0}), 320, 320);
  ASSERT_TRUE(camera);
  ChangePicture picture;
  const ViewCorners picture_view(*camera, s.rays, nullptr);
  picture.update(picture_view, s.change, nullptr);
  EXPECT_GT(picture.left_out(), 0.5f * ChangePicture::kThreshold) << "the window of the share was met";
  EXPECT_LT(picture.left_out(), ChangePicture::kThreshold * 2.0f / 3.0f);
  int whole = 0, nothing = 0;
  for (int y = 0; y < 320; ++y)
    for (int x = 0; x < 320; ++x) {
      const glm::dvec3 w = camera->direction({x, y});
      const glm::dvec3 p = camera->eye() - camera->eye().z / w.z * w;
      const IndirectChange here = s.at(p);
      const float relative = here.irradiance.g / here.before.g;
      const auto drawn = picture.at(x, y);
      if (relative > 0.02f && relative < 0.1f) { // beyond, it turns within a block of pixels
        ASSERT_TRUE(drawn);
        EXPECT_NEAR(drawn->irradiance.g / drawn->before.g, relative, 0.006f)
            << "of the light before; blocks are half as wide as the object";
        ++whole;
      }
      if (relative < 0.4f * ChangePicture::kThreshold) {
        EXPECT_FALSE(drawn);
        ++nothing;
      }
    }
  EXPECT_GT(whole, 2000);
  EXPECT_GT(nothing, 30000);
}

/// A dark post in a bright room, and a glowing ball beside it.
struct BallBesidePost : Surrounded {
  static constexpr int kSide = 160, kRays = 8; ///< pixels; rays along a side of one
  RenderCamera camera = test::look_at({3.2, 3.4, 0.9}, {1.95, 2.1, 0.2}, kSide, kSide, 0.35);

  BallBesidePost()
      : Surrounded(0.08f, {}, 0.0f, [](Room& room) {
          room.materials.push_back({"dark", Rgb(0.04f), Rgb(1.0f), false});
          test::add_block(room, {1.9, 2.0, 0.0}, {1.96, 2.06, 1.0}, 1);
        }) {
    place({2.06, 2.22, 0.15}, 20.0f);
  }
  /// Mean over rays through a pixel of what the room reflects, without the ball and with it.
  std::array<double, 2> reflected(int x, int y) const {
    std::array<double, 2> mean{};
    for (int k = 0; k < kRays * kRays; ++k) {
      const glm::dvec2 p = glm::dvec2(x, y) + (glm::dvec2(k % kRays, k / kRays) + 0.5) / double(kRays) - 0.5;
      const glm::dvec3 w = camera.direction(p);
      RayHit hit;
      EXPECT_TRUE(rays.closest(rays.to_local(camera.eye()), glm::vec3(w), 0.0f, 100.0f, hit));
      const IndirectChange here = change.at(hit.triangle, camera.eye() + static_cast<double>(hit.distance) * w, w);
      const auto share = volume.room.material(volume.room.triangles[hit.triangle]).reflectance.g / float(kRays * kRays);
      mean[0] += static_cast<double>(share * here.before.g);
      mean[1] += static_cast<double>(share * (here.before.g + here.irradiance.g));
    }
    return mean;
  }
};

TEST(Compose, a_pixel_that_shows_a_dark_post_and_a_bright_floor_takes_the_change_of_both) {
  BallBesidePost s;
  auto renderer = TracedRenderer::make(s.volume.room, {});
  ASSERT_TRUE(renderer);
  RenderedFrame frame;
  for (const auto& step :
       {renderer->set_camera(s.camera), renderer->set_objects({}), renderer->set_lights({}), renderer->draw(frame)})
    ASSERT_TRUE(step) << step.error().message();
  ChangePicture change;
  const ViewCorners view(s.camera, s.rays, &*renderer);
  change.update(view, s.change, nullptr);
  const auto look_up = [&](const glm::dvec3& direction, std::uint32_t triangle) {
    return s.room_light.at_plane(triangle, s.camera.eye(), direction);
  };
  constexpr int kSide = BallBesidePost::kSide;
  RgbImage photo(kSide, kSide, Rgb(1.0f));
  std::vector<std::pair<std::size_t, double>> with_ball; // of the pixels that show several surfaces
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x)
      if (!view.parts(x, y).empty()) {
        const std::array<double, 2> mean = s.reflected(x, y);
        const std::size_t i = static_cast<std::size_t>(y) * kSide + x;
        photo.texels[i] = Rgb(static_cast<float>(mean[0]));
        with_ball.emplace_back(i, mean[1]);
      }
  Composite result;
  compose(photo, frame, s.camera, look_up, {}, result, &change);
  double square = 0.0, worst = 0.0;
  for (const auto& [i, expected] : with_ball) {
    const double error = static_cast<double>(result.picture.texels[i].g) / expected - 1.0;
    square += error * error;
    worst = std::max(worst, std::fabs(error));
  }
  EXPECT_GT(with_ball.size(), 200u);
  EXPECT_LT(std::sqrt(square / static_cast<double>(with_ball.size())), 0.06) << "sixteen rays know a part to 1/16";
  EXPECT_LT(worst, 0.3);
}

/// Irradiance of a point of the wall x = 0 by the patch of sun on the floor, white walls: a sum over squares of the
/// floor from which the window is seen towards the sun.
double from_sun_patch(const glm::dvec3& point, const DetectedSun& sun) {
  constexpr double kStep_m = 0.01;
  double sum = 0.0;
  for (double x = 0.5 * kStep_m; x < 4.0; x += kStep_m)
    for (double y = 0.5 * kStep_m; y < 5.0; y += kStep_m) {
      const glm::dvec3 through = glm::dvec3(x, y, 0) + (5.0 - y) / sun.direction.y * sun.direction;
      if (through.x < 1.2 || through.x > 2.8 || through.z < 0.9 || through.z > 2.1)
        continue;
      const glm::dvec3 way = point - glm::dvec3(x, y, 0);
      const double distance2 = glm::dot(way, way);
      sum += double(sun.normal_irradiance.g) * sun.direction.z / test::kPi * way.z * -way.x / (distance2 * distance2);
    }
  return sum * kStep_m * kStep_m;
}

TEST(IndirectShadow, a_gain_beside_a_patch_of_sun_that_the_volume_lacks_is_a_part_of_what_is_there) {
  const std::vector<Aperture> windows = test::box_window();
  const glm::dvec3 ball(0.12, 3.1, 0.55), point(0.0, 3.1, 0.25), towards_wall(-1, 0, 0);
  Surrounded s(0.06f, windows);
  RayHit hit;
  ASSERT_TRUE(s.rays.closest(s.rays.to_local(point - 0.5 * towards_wall), glm::vec3(towards_wall), 0.0f, 1.0f, hit));
  s.place(ball, 40.0f);
  const IndirectChange without = s.change.at(hit.triangle, point, towards_wall);
  DetectedSun sun = test::sun_through_the_window();
  sun.normal_irradiance = Rgb(180.0f);
  s.place(ball, 40.0f, sun);
  const IndirectChange with = s.change.at(hit.triangle, point, towards_wall);
  const double volume = static_cast<double>(without.before.g), patch = from_sun_patch(point, sun);
  ASSERT_GT(patch, 0.3 * volume);
  ASSERT_LT(patch, 0.9 * volume) << "less than what is corrected at most";
  ASSERT_GT(without.irradiance.g, 0.2f * without.before.g);
  EXPECT_NEAR(double(with.irradiance.g / without.irradiance.g), volume / (volume + patch), 0.08);
  EXPECT_EQ(with.before, without.before);
}

TEST(Compose, blocks_show_what_their_pixels_show_one_by_one) {
  constexpr int kSide = 320;
  const std::vector<Aperture> windows = test::box_window();
  Surrounded s(0.12f, windows, 40.0f);
  const glm::dvec3 place(2.0, 3.6, 0.13);
  s.place(place, 1.0f);
  auto renderer = TracedRenderer::make(s.volume.room, windows);
  ASSERT_TRUE(renderer);
  const RenderCamera camera = test::look_at({2.6, 4.7, 1.0}, {2.0, 3.5, 0.1}, kSide, kSide, 0.9);
  const ObjectSurface object = test::place(s.mesh, place);
  const LightSet lights = sample_lights(s.pyramid[0], {}, windows, object.bounds(), 64);
  RenderedFrame frame;
  for (const auto& step : {renderer->set_camera(camera), renderer->set_objects(object), renderer->set_lights(lights),
                           renderer->draw(frame)})
    ASSERT_TRUE(step) << step.error().message();
  ChangePicture change;
  const ViewCorners change_view(camera, s.rays, nullptr);
  change.update(change_view, s.change, nullptr);
  const RgbImage photo(kSide, kSide, Rgb(0.4f, 0.5f, 0.6f));
  const auto look_up = [&](const glm::dvec3& direction, std::uint32_t triangle) {
    return triangle == kUnknownTriangle ? s.room_light.at(camera.eye(), direction)
                                        : s.room_light.at_plane(triangle, camera.eye(), direction);
  };
  Composite blocks, pixels;
  compose(photo, frame, camera, look_up, {}, blocks, &change);
  ChangePicture beside;
  beside.update(change_view, s.change, &frame);
  Composite same;
  compose(photo, frame, camera, look_up, {}, same, &beside);
  int behind = 0; // pixels that look_up() at the corners was spared
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * kSide + x;
      ASSERT_EQ(same.picture.texels[i], blocks.picture.texels[i]) << x << " " << y;
      behind += change.at(x, y) && !beside.at(x, y);
      ASSERT_TRUE(!change.at(x, y) || beside.at(x, y) || blocks.coverage[i] == 1.0f);
    }
  EXPECT_GT(behind, 100) << "nothing is looked up behind the object";
  // A frame that does not know its triangles, and shows every block, is composed pixel by pixel.
  RenderedFrame every = frame;
  for (int row = 0; row < frame.rows(); ++row)
    for (int column = 0; column < frame.columns(); ++column) {
      if (!frame.shows(column, row))
        every.show(column, row);
      for (int k = 0; k < RenderedFrame::kBlock * RenderedFrame::kBlock; ++k)
        every.at(4 * column + k % 4, 4 * row + k / 4).triangle = kUnknownTriangle;
    }
  compose(photo, every, camera, look_up, {}, pixels, &change);
  double square = 0.0, largest = 0.0, darkest = 1.0;
  int touched = 0, otherwise = 0;
  for (std::size_t i = 0; i < photo.texels.size(); ++i) {
    ASSERT_EQ(blocks.touched[i] == 2, pixels.touched[i] == 2);
    if (pixels.touched[i] == 2)
      continue;
    otherwise += blocks.touched[i] != pixels.touched[i];
    const double a = static_cast<double>(blocks.picture.texels[i].g),
                 b = static_cast<double>(pixels.picture.texels[i].g);
    square += (a - b) * (a - b) / (b * b);
    largest = std::max(largest, std::fabs(a - b) / b);
    darkest = std::min(darkest, b / 0.5);
    touched += pixels.touched[i] == 1;
  }
  EXPECT_GT(touched, 5000);
  EXPECT_LT(darkest, 0.5) << "a shadow";
  EXPECT_LT(std::sqrt(square / touched), 2e-4) << "light between the corners of eight pixels, taken as straight";
  EXPECT_LT(largest, 0.01);
  EXPECT_LT(otherwise, touched / 50) << "of half a code value";
}

} // namespace
} // namespace daylit
