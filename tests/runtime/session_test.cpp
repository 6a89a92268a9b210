#include <algorithm>

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

} // namespace
} // namespace daylit
