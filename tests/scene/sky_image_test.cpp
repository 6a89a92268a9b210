#include "scene/sky/sky_image.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

namespace daylit {
namespace {

constexpr double kPi = std::numbers::pi;

double sum(const std::vector<float>& values) { return std::accumulate(values.begin(), values.end(), 0.0); }

/// A fish-eye that looks straight up: camera x = world x, camera y = -world y, camera z = world z.
FisheyeProjection upward_fisheye(int width, int height, double field_of_view) {
  FisheyeProjection p;
  p.lens = ideal_fisheye(width, height, field_of_view);
  p.lens.world_from_camera = glm::dmat3(1, 0, 0, 0, -1, 0, 0, 0, 1);
  return p;
}

glm::dvec3 direction_of(double azimuth_deg, double altitude_deg) {
  const double a = azimuth_deg * kPi / 180, h = altitude_deg * kPi / 180;
  return {std::cos(h) * std::cos(a), std::cos(h) * std::sin(a), std::sin(h)};
}

TEST(SkyGeometry, equirect_solid_angles_are_exact_bands) {
  const auto g = *SkyGeometry::make(64, 32, EquirectProjection{});
  EXPECT_NEAR(sum(g->solid_angle_sr()), 4 * kPi, 1e-5);
  for (int y = 0; y < 32; ++y) {
    const double band = std::cos(kPi * y / 32) - std::cos(kPi * (y + 1) / 32);
    EXPECT_NEAR(double(g->solid_angle_sr()[static_cast<std::size_t>(y) * 64]) / (2 * kPi / 64 * band), 1.0, 1e-6);
  }
}

TEST(SkyGeometry, angular_map_covers_the_sphere) {
  for (int side : {16, 65, 256, 900})
    EXPECT_NEAR(sum((*SkyGeometry::make(side, side, AngularProjection{}))->solid_angle_sr()) / (4 * kPi), 1.0, 1e-4)
        << side;
}

TEST(SkyGeometry, fisheye_solid_angles_sum_to_the_true_field) {
  for (double degrees : {120.0, 180.0, 190.0, 220.0}) {
    const double half = degrees / 2 * kPi / 180;
    const auto g = *SkyGeometry::make(128, 124, upward_fisheye(128, 124, 2 * half));
    EXPECT_NEAR(sum(g->solid_angle_sr()) / (2 * kPi * (1 - std::cos(half))), 1.0, 1e-4) << degrees;
  }
}

TEST(SkyGeometry, distorted_fisheye_solid_angles_sum_to_the_true_field) {
  FisheyeProjection p = upward_fisheye(256, 256, kPi);
  p.lens.distortion = {-0.0021, -0.0008, -0.0029, 0.0003, 0, 0, 0, 0};
  const auto g = *SkyGeometry::make(256, 256, p);
  EXPECT_NEAR(sum(g->solid_angle_sr()) / (2 * kPi), 1.0, 1e-4);
}

TEST(SkyGeometry, pinhole_solid_angle_is_that_of_a_rectangle) {
  // Rectangle of half-angles a, b seen from its axis: 4 asin(sin a sin b) (pyramid with apex angles 2a, 2b).
  FisheyeProjection p;
  p.lens = ideal_pinhole(200, 100, 1.6);
  const double tan_a = std::tan(0.8), tan_b = 0.5 * tan_a;
  const double expected = 4 * std::atan(tan_a * tan_b / std::sqrt(1 + tan_a * tan_a + tan_b * tan_b));
  const auto g = *SkyGeometry::make(200, 100, p);
  EXPECT_NEAR(sum(g->solid_angle_sr()) / expected, 1.0, 1e-6);
}

TEST(SkyGeometry, direction_and_pixel_are_inverse) {
  const SkyProjection projections[] = {EquirectProjection{0.7}, AngularProjection{{0, 1, 0}, {0, 0, 1}, 0.3},
                                       upward_fisheye(128, 128, 3.3)};
  for (const SkyProjection& projection : projections) {
    const auto g = *SkyGeometry::make(128, 128, projection);
    for (int y = 0; y < 128; y += 5)
      for (int x = 0; x < 128; x += 7)
        if (const auto d = g->direction({x + 0.25, y - 0.25})) {
          EXPECT_NEAR(glm::length(*d), 1.0, 1e-12);
          const auto p = g->pixel(*d);
          ASSERT_TRUE(p);
          EXPECT_NEAR(p->x, x + 0.25, 1e-8);
          EXPECT_NEAR(p->y, y - 0.25, 1e-8);
        }
  }
}

TEST(SkyGeometry, equirect_frame_is_the_documented_one) {
  const auto g = *SkyGeometry::make(360, 180, EquirectProjection{});
  // Pixel borders are at whole degrees: the centre of the image lies between pixels 179 and 180.
  EXPECT_NEAR(glm::length(*g->direction({179.5, 89.5}) - glm::dvec3(1, 0, 0)), 0, 1e-12);
  EXPECT_NEAR(glm::length(*g->direction({89.5, 89.5}) - glm::dvec3(0, 1, 0)), 0, 1e-12); // azimuth grows to the left
  EXPECT_NEAR(glm::length(*g->direction({10.0, -0.5}) - glm::dvec3(0, 0, 1)), 0, 1e-12);
}

TEST(SkyGeometry, rotation_turns_the_sky_counter_clockwise) {
  const double quarter = kPi / 2;
  const SkyProjection plain[] = {EquirectProjection{}, AngularProjection{}, upward_fisheye(128, 128, 3.0)};
  const SkyProjection turned[] = {EquirectProjection{quarter}, AngularProjection{{1, 0, 0}, {0, 0, 1}, quarter}, [&] {
                                    auto p = upward_fisheye(128, 128, 3.0);
                                    p.rotation = quarter;
                                    return p;
                                  }()};
  for (int i = 0; i < 3; ++i) {
    const auto a = *SkyGeometry::make(128, 128, plain[i]), b = *SkyGeometry::make(128, 128, turned[i]);
    const glm::dvec3 d = *a->direction({70, 50}), e = *b->direction({70, 50});
    EXPECT_NEAR(glm::length(e - glm::dvec3(-d.y, d.x, d.z)), 0, 1e-12) << i; // seen from above, +x goes to +y
  }
}

TEST(SkyGeometry, angular_map_is_debevecs) {
  const auto g = *SkyGeometry::make(200, 200, AngularProjection{}); // forward +x, up +z: right is -y
  EXPECT_NEAR(glm::length(*g->direction({99.5, 99.5}) - glm::dvec3(1, 0, 0)), 0, 1e-12);
  EXPECT_NEAR(glm::length(*g->direction({149.5, 99.5}) - glm::dvec3(0, -1, 0)), 0, 1e-9); // r = 1/2 is 90 degrees
  EXPECT_NEAR(glm::length(*g->direction({99.5, 49.5}) - glm::dvec3(0, 0, 1)), 0, 1e-9);
  EXPECT_NEAR(glm::length(*g->direction({199.5, 99.5}) - glm::dvec3(-1, 0, 0)), 0, 1e-9);
  EXPECT_FALSE(g->direction({199.0, 199.0}));
}

TEST(SkyImage, equidistant_fisheye_pixel_mean_is_3_73_percent_below_the_solid_angle_mean) {
  // Under the overcast sky (1 + 2 sin h)/3 the solid-angle mean over the hemisphere is 2/3. Pixels of an equidistant
  // lens are uniform in theta dtheta: the plain mean is 8/pi^2 * integral of theta (1 + 2 cos theta)/3 over 0..pi/2
  // = 8/(3 pi^2) (pi^2/8 + pi - 2) = 1/3 + 8 (pi - 2)/(3 pi^2) = 0.6418, which is 3.73 % lower.
  const int side = 512;
  RgbImage image(side, side);
  const auto projection = upward_fisheye(side, side, kPi);
  const auto g = *SkyGeometry::make(side, side, projection);
  double plain = 0, weighted = 0, weight = 0;
  int pixels = 0;
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x)
      if (const auto d = g->direction({double(x), double(y)})) {
        const double radiance = (1 + 2 * d->z) / 3;
        const double omega = double(g->solid_angle_sr()[static_cast<std::size_t>(y * side + x)]);
        plain += radiance, ++pixels;
        weighted += omega * radiance, weight += omega;
      }
  EXPECT_NEAR(weighted / weight, 2.0 / 3.0, 3e-4); // rim pixels whose centre is outside are left out here
  EXPECT_NEAR(plain / pixels / (2.0 / 3.0) - 1, -0.0373, 2e-4);
}

TEST(SkyImage, bad_radiance_in_the_field_says_how_many_and_where) {
  RgbImage image(8, 4, Rgb(1.0f));
  image.at(3, 2).g = std::numeric_limits<float>::quiet_NaN();
  image.at(5, 3).b = std::numeric_limits<float>::infinity();
  auto sky = SkyImage::make(image, EquirectProjection{}, {}, "sky.exr");
  ASSERT_FALSE(sky);
  EXPECT_EQ(sky.error().code, ErrorCode::value_invalid);
  EXPECT_NE(sky.error().message().find("2 pixels"), std::string::npos) << sky.error().message();
  EXPECT_NE(sky.error().message().find("sky.exr, first at pixel (3, 2)"), std::string::npos);
  image = RgbImage(8, 4, Rgb(1.0f));
  image.at(0, 1).r = -1e-6f;
  sky = SkyImage::make(image, EquirectProjection{}, {}, "sky.exr");
  ASSERT_FALSE(sky);
  EXPECT_NE(sky.error().message().find("negative in 1 pixels"), std::string::npos) << sky.error().message();
  EXPECT_FALSE(sky.error().hint.empty());
}

TEST(SkyImage, bad_radiance_outside_the_field_is_ignored) {
  RgbImage image(32, 32, Rgb(1.0f));
  image.at(0, 0).r = std::numeric_limits<float>::quiet_NaN();
  const auto sky = SkyImage::make(image, AngularProjection{});
  ASSERT_TRUE(sky);
  EXPECT_EQ(sky->image().at(0, 0), Rgb(0.0f));
}

TEST(SkyImage, an_uncovered_sphere_needs_a_declared_ground) {
  const RgbImage image(64, 64, Rgb(2.0f));
  const auto projection = upward_fisheye(64, 64, kPi);
  EXPECT_FALSE(SkyImage::make(image, projection));
  const auto sky = SkyImage::make(image, projection, {GroundFill::Kind::albedo, 0.2f});
  ASSERT_TRUE(sky);
  // Uniform radiance 2: E = 2 pi, ground = albedo * E / pi = 0.4.
  EXPECT_NEAR(sky->fill_radiance().g, 0.4f, 1e-6f);
  EXPECT_NEAR(sky->radiance(direction_of(20, -30)).r, 0.4f, 1e-6f);
  EXPECT_NEAR(sky->radiance(direction_of(20, 30)).r, 2.0f, 1e-6f);
  EXPECT_FALSE(SkyImage::make(image, projection, {GroundFill::Kind::albedo, 1.5f}));
}

TEST(SkyImage, wrong_geometry_is_an_error) {
  EXPECT_FALSE(SkyImage::make(RgbImage(64, 32), AngularProjection{}));
  EXPECT_FALSE(SkyImage::make(RgbImage(64, 64), AngularProjection{{0, 0, 1}, {0, 0, 2}, 0}));
  EXPECT_FALSE(SkyImage::make(RgbImage(64, 64), upward_fisheye(64, 62, 3.0), {GroundFill::Kind::albedo, 0.2f}));
  EXPECT_FALSE(SkyImage::make(RgbImage(), EquirectProjection{}));
  EXPECT_FALSE(parse_projection("cylinder", 0, {1, 0, 0}, {0, 0, 1}));
  EXPECT_FALSE(parse_projection("fisheye:/no/such/lens.yaml", 0, {1, 0, 0}, {0, 0, 1}));
}

} // namespace
} // namespace daylit
