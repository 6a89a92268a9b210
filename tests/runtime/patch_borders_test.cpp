// The border of a patch of sun on the floor, in the shadow of an object: what the photograph holds of the sun in its
// pixels is not what was drawn.

#include "runtime/composite/patch_borders.h"

#include <cstring>

#include <gtest/gtest.h>

#include "runtime/depth/thing_layer.h"
#include "test_scene.h"

namespace daylit {
namespace {

constexpr int kSide = 16, kBorder = 8, kShadow = 4; ///< first column without sun, first row of the shadow
constexpr float kSun = 0.5f;                        ///< received of it, in the patch

struct Floor {
  RenderCamera camera = test::look_at({2, 1, 1}, {2, 4, 1}, kSide, kSide, 0.8);
  RgbImage photo{kSide, kSide, Rgb(0.0f)};
  RenderedFrame frame;
  RoomPoint point{Rgb(1.0f), Rgb(3.0f), Rgb(100.0f), Rgb(0.5f)}; ///< indirect 1, open sky 3, sun 100

  /// The border's column has a fifth of the sun as it is drawn, `in_photo` of it in the photograph.
  explicit Floor(float in_photo) {
    frame.start(kSide, kSide, {0, 0, kSide, kSide});
    for (int y = 0; y < kSide; y += RenderedFrame::kBlock)
      for (int x = 0; x < kSide; x += RenderedFrame::kBlock)
        frame.show(x / RenderedFrame::kBlock, y / RenderedFrame::kBlock);
    for (int y = 0; y < kSide; ++y)
      for (int x = 0; x < kSide; ++x) {
        const float drawn = x < kBorder ? kSun : x == kBorder ? 0.2f * kSun : 0.0f;
        const float sun = x == kBorder ? in_photo * kSun : drawn;
        frame.at(x, y) = {glm::vec4(0.0f), glm::vec4(0, 0, 0, 1), glm::vec2(1, drawn), Rgb(y >= kShadow ? drawn : 0.0f),
                          5};
        photo.at(x, y) = Rgb(0.01f * (4.0f + 100.0f * sun));
      }
  }
  Composite run(const ComposeSettings& settings = {}) const {
    return compose(
        photo, frame, camera, [&](const glm::dvec3&, std::uint32_t) { return std::optional(point); }, settings);
  }
};

TEST(PatchBorders, leave_no_line_in_the_shadow) {
  for (const float in_photo : {0.05f, 0.2f, 0.6f, 1.0f}) {
    const Floor floor(in_photo);
    const Composite result = floor.run();
    for (int y = kShadow; y < kSide; ++y)
      for (int x = 0; x < kSide; ++x)
        ASSERT_NEAR(result.picture.at(x, y).g, 0.04f, 1e-5f) << x << ", " << y;
    EXPECT_EQ(result.touched[static_cast<std::size_t>(9) * kSide + kBorder], 1);
  }
}

TEST(PatchBorders, outside_the_shadow_are_the_photographs) {
  const Floor floor(0.6f);
  const Composite result = floor.run();
  EXPECT_EQ(0, std::memcmp(result.picture.texels.data(), floor.photo.texels.data(), kShadow * kSide * sizeof(Rgb)));
}

TEST(PatchBorders, are_filled_from_their_own_triangle_alone_also_in_a_distorted_photograph) {
  Floor floor(0.6f);
  for (int y = 0; y < kSide; ++y)
    for (int x = kBorder; x < kSide; ++x) {
      floor.frame.at(x, y).triangle = 6;
      floor.photo.at(x, y) *= 0.5f;
    }
  for (const bool distorted : {false, true}) {
    for (int y = 0; distorted && y < kSide; ++y)
      for (int x = 0; x < kSide; ++x)
        floor.camera.drawn_position.emplace_back(x, y);
    const Composite result = floor.run();
    EXPECT_NEAR(result.picture.at(kBorder - 1, 12).g, 0.04f, 1e-5f) << distorted;
    EXPECT_NEAR(result.picture.at(kBorder, 12).g, 0.02f, 1e-5f) << distorted;
  }
}

TEST(PatchBorders, behind_real_things_are_left) {
  const Floor floor(0.6f);
  ThingLayer things{std::vector<float>(kSide * kSide, 0.0f), std::vector<float>(kSide * kSide, 0.0f), {}, [](int, int) {
                      return Rgb(1.0f);
                    }};
  const std::size_t at = 12 * kSide + kBorder;
  things.part[at] = 1.0f;
  Composite result;
  compose(
      floor.photo, floor.frame, floor.camera,
      [&](const glm::dvec3&, std::uint32_t) { return std::optional(floor.point); }, {}, result, nullptr, &things);
  EXPECT_EQ(result.picture.texels[at], floor.photo.texels[at]);
  EXPECT_NEAR(result.picture.at(kBorder, 11).g, 0.04f, 1e-5f);
}

TEST(PatchBorders, of_which_the_shadow_takes_a_part_of_the_sun_are_left) {
  Floor floor(0.6f);
  for (int y = kShadow; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x)
      floor.frame.at(x, y).lost_sun *= 0.5f;
  const float ratio = (4.0f + 0.5f * 100.0f * 0.2f * kSun) / (4.0f + 100.0f * 0.2f * kSun);
  EXPECT_NEAR(floor.run().picture.at(kBorder, 12).g, ratio * floor.photo.at(kBorder, 12).g, 1e-5f);
}

} // namespace
} // namespace daylit
