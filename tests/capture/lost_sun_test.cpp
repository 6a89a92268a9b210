// A sky with a sun beyond the range of the camera: found, and put back by an illuminance reading.

#include "capture/hdr/lost_sun.h"

#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

namespace daylit {
namespace {

constexpr int kSide = 256;

struct Case {
  std::shared_ptr<const SkyGeometry> geometry;
  RgbImage truth{kSide, kSide, Rgb(0.8f, 1.0f, 1.5f)}, clipped;
  std::vector<std::uint8_t> over_range = std::vector<std::uint8_t>(kSide * kSide);
  glm::dvec3 sun{0.0};
};

/// A sun of 2 x 2 pixels at (x, y), three fifths of the illuminance; the camera shows 20 at most.
Case sunny(int x, int y, double field_of_view = 3.3) {
  Case c;
  LensModel lens = ideal_fisheye(kSide, kSide, field_of_view);
  c.geometry = *SkyGeometry::make(kSide, kSide, FisheyeProjection{lens, 0.0});
  for (int k = 0; k < 4; ++k) {
    const std::size_t i = static_cast<std::size_t>(y + k / 2) * kSide + static_cast<std::size_t>(x + k % 2);
    c.truth.texels[i] = Rgb(1.1f / c.geometry->projected_solid_angle_sr()[i]);
    c.over_range[i] = 1;
  }
  c.clipped = c.truth;
  for (Rgb& t : c.clipped.texels)
    t = glm::min(t, Rgb(20.0f));
  c.sun = *c.geometry->direction({x + 0.5, y + 0.5});
  return c;
}

Rgb irradiance(const Case& c, const RgbImage& radiance) {
  return horizontal_irradiance(*SkyImage::make(radiance, c.geometry, {GroundFill::Kind::albedo, 0.2f}));
}

TEST(LostSun, stands_where_the_pixels_over_range_are) {
  const Case c = sunny(150, 90);
  const auto found = lost_sun(*c.geometry, c.over_range, std::nullopt);
  ASSERT_TRUE(found);
  EXPECT_GT(glm::dot(found->direction, c.sun), std::cos(0.003));
  const auto by_place = lost_sun(*c.geometry, c.over_range, glm::normalize(c.sun + glm::dvec3(0.02, 0, 0)));
  ASSERT_TRUE(by_place) << "a degree off";
  EXPECT_GT(std::acos(glm::dot(by_place->direction, c.sun)), 0.01) << "place and time know it better than glare";
}

TEST(LostSun, reflections_are_no_sun) {
  Case c = sunny(150, 90);
  EXPECT_FALSE(lost_sun(*c.geometry, c.over_range, -c.sun)) << "place and time say it is elsewhere";
  c.over_range[100 * kSide + 60] = 1;
  EXPECT_FALSE(lost_sun(*c.geometry, c.over_range, std::nullopt)) << "two places";
  EXPECT_FALSE(lost_sun(*c.geometry, std::vector<std::uint8_t>(kSide * kSide), std::nullopt)) << "none";
}

TEST(LostSun, an_illuminance_reading_restores_the_irradiance_of_every_channel) {
  Case c = sunny(150, 90);
  const Rgb truth = irradiance(c, c.truth), before = irradiance(c, c.clipped);
  EXPECT_LT(before.g, 0.5f * truth.g);
  ASSERT_TRUE(restore_sun(c.clipped, *c.geometry, c.sun, 1.02 * double(luminance(truth)))) << "a meter 2 % off";
  const Rgb after = irradiance(c, c.clipped);
  EXPECT_NEAR(luminance(after), 1.02f * luminance(truth), 1e-3f * luminance(truth));
  for (int channel = 0; channel < 3; ++channel)
    EXPECT_NEAR(after[channel], truth[channel], 0.03f * truth[channel]);
}

TEST(LostSun, a_lens_that_does_not_see_the_whole_hemisphere_fills_it_to_the_same_reading) {
  Case c = sunny(150, 90, 2.4);
  ASSERT_TRUE(restore_sun(c.clipped, *c.geometry, c.sun, 12.0));
  EXPECT_NEAR(luminance(irradiance(c, c.clipped)), 12.0f, 0.01f);
}

TEST(LostSun, a_reading_below_what_is_seen_adds_nothing) {
  Case c = sunny(150, 90);
  const RgbImage before = c.clipped;
  EXPECT_TRUE(restore_sun(c.clipped, *c.geometry, c.sun, 0.1));
  EXPECT_EQ(c.clipped.texels, before.texels);
  EXPECT_FALSE(restore_sun(c.clipped, *c.geometry, {0.0, 0.0, -1.0}, 1e6)) << "below the horizon";
}

TEST(LostSun, without_a_reading_the_irradiance_is_known_between_bounds) {
  const Case c = sunny(150, 90);
  SkyBalance balance{4, 0, true, false, irradiance(c, c.clipped)};
  const Rgb truth = irradiance(c, c.truth);
  EXPECT_LT(balance.irradiance.g, truth.g);
  ASSERT_TRUE(balance.irradiance_at_most());
  EXPECT_GT(balance.irradiance_at_most()->g, truth.g);
  balance.unexplained = 1;
  EXPECT_FALSE(balance.irradiance_at_most()) << "more than the sun is lost";
  balance.sun_restored = true;
  EXPECT_EQ(balance.irradiance_at_most(), balance.irradiance);
}

} // namespace
} // namespace daylit
