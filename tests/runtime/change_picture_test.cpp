// The picture of what an object changes: what is left out of it, and what is composed from it.

#include <gtest/gtest.h>

#include "runtime/composite/change_picture.h"
#include "runtime/composite/compose.h"
#include "runtime/sky/window_sampler.h"
#include "runtime/trace/traced_renderer.h"
#include "scene/lens/lens.h"
#include "surrounded.h"

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
