#include "scene/direct_sky.h"

#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "scene/aperture.h"
#include "tests/scene/test_rooms.h"

namespace daylit {
namespace {

using test::room_with_hole;
constexpr double kPi = std::numbers::pi;

SkyImage equirect_image(int height, auto radiance) {
  RgbImage image(2 * height, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < 2 * height; ++x) {
      const double theta = kPi * (y + 0.5) / height, phi = 2 * kPi * (0.5 - (x + 0.5) / (2 * height));
      image.at(x, y) =
          Rgb(radiance(glm::dvec3(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta))));
    }
  return *SkyImage::make(std::move(image), EquirectProjection{});
}

Sky equirect(int height, auto radiance) { return Sky(equirect_image(height, radiance)); }

/// Config. factor of an element parallel to a rectangle a x b at distance c, below its corner (Howell C-11).
double corner_factor(double a, double b, double c) {
  const double x = a / c, y = b / c, p = std::sqrt(1 + x * x), q = std::sqrt(1 + y * y);
  return (x / p * std::atan(y / p) + y / q * std::atan(x / q)) / (2 * kPi);
}

struct Case {
  explicit Case(Room made)
      : room(std::move(made)), scene(*RayScene::build(room)), openings(find_apertures(room, scene)->list) {}
  Room room;
  RayScene scene;
  std::vector<Aperture> openings;
};

TEST(DirectSky, uniform_sky_through_a_hole_is_pi_times_the_view_factor) {
  const Case c(room_with_hole().room); // hole x 1..3, z 1..2 in y = 0
  const Sky sky = equirect(64, [](const glm::dvec3&) { return Rgb(2.0f); });
  const DirectSky direct(c.room, c.openings, c.scene, sky);
  for (const double distance : {0.05, 0.5, 2.0, 4.9}) {
    // Facing the hole from its middle axis: four corner factors of 1 x 0.5.
    const double expected = 2.0 * kPi * 4.0 * corner_factor(1.0, 0.5, distance);
    EXPECT_NEAR(glm::dvec3(direct.irradiance({2, distance, 1.5}, {0, -1, 0})).g / expected, 1.0, 1e-3) << distance;
  }
  EXPECT_EQ(direct.irradiance({2, 2, 1.5}, {0, 1, 0}), Rgb(0.0f)) << "facing away";
}

TEST(DirectSky, light_is_split_exactly_at_the_horizon) {
  const Case c(room_with_hole().room);
  const Sky sky = equirect(64, [](const glm::dvec3& w) { return Rgb(w.z < 0 ? 0.0f : 1.0f); });
  const DirectSky direct(c.room, c.openings, c.scene, sky);
  for (const double z : {1.13, 1.5, 1.71}) { // of the hole, the part higher than the receiver shows sky
    const double expected = kPi * 2.0 * corner_factor(1.0, 2.0 - z, 4.5);
    EXPECT_NEAR(glm::dvec3(direct.irradiance({2, 4.5, z}, {0, -1, 0})).g / expected, 1.0, 1e-3) << z;
  }
}

TEST(DirectSky, furniture_hides_its_share) {
  test::RoomBuilder b = room_with_hole();
  b.quad({2, 1, 0}, {4, 1, 0}, {4, 1, 3}, {2, 1, 3}, 0); // a sheet that hides the right half from the axis
  const Case c(b.room);
  const Sky sky = equirect(64, [](const glm::dvec3&) { return Rgb(1.0f); });
  const DirectSky direct(c.room, c.openings, c.scene, sky);
  EXPECT_NEAR(glm::dvec3(direct.irradiance({2, 2, 1.5}, {0, -1, 0})).g / (kPi * 2.0 * corner_factor(1.0, 0.5, 2.0)),
              1.0, 5e-3);
}

TEST(DirectSky, panes_multiply_and_light_is_counted_once) {
  test::RoomBuilder b = room_with_hole();
  const auto glass = b.material("window", Rgb(0), Rgb(0.5f, 0.6f, 0.7f));
  for (const double y : {0.0, -0.02}) // double glazing, wide enough to fill the view
    b.quad({1, y, 1}, {3, y, 1}, {3, y, 2}, {1, y, 2}, glass);
  const Case c(b.room);
  ASSERT_EQ(c.openings.size(), 2u);
  const Sky sky = equirect(64, [](const glm::dvec3&) { return Rgb(1.0f); });
  const glm::dvec3 e(DirectSky(c.room, c.openings, c.scene, sky).irradiance({2, 4, 1.5}, {0, -1, 0}));
  const double open = kPi * 4.0 * corner_factor(1.0, 0.5, 4.0);
  EXPECT_NEAR(e.r / open, 0.25, 0.25 * 0.02); // rays that miss the second pane at its rim pass one only
  EXPECT_NEAR(e.b / open, 0.49, 0.49 * 0.02);
}

TEST(DirectSky, sun_of_one_texel_keeps_its_energy) {
  const Case c(room_with_hole().room);
  const glm::dvec3 sun = glm::normalize(glm::dvec3(0.13, -1.0, 0.21));
  const SkyImage plain = equirect_image(256, [](const glm::dvec3&) { return Rgb(1.0f); });
  const std::size_t texel = *plain.geometry()->texel(sun);
  RgbImage image = plain.image();
  image.texels[texel] = Rgb(1e5f);
  const Sky sky(*SkyImage::make(image, EquirectProjection{})), even(plain);
  const glm::dvec3 p(2, 2, 1.5), n(0, -1, 0);
  const double before = glm::dvec3(DirectSky(c.room, c.openings, c.scene, even).irradiance(p, n)).g;
  const double after = glm::dvec3(DirectSky(c.room, c.openings, c.scene, sky).irradiance(p, n)).g;
  const glm::dvec3 centre = *plain.direction({static_cast<double>(texel % 512), static_cast<double>(texel / 512)});
  const double expected = 1e5 * static_cast<double>(plain.solid_angle_sr()[texel]) * glm::dot(centre, n);
  EXPECT_NEAR((after - before) / expected, 1.0, 2e-3);
  EXPECT_NEAR(DirectSky(c.room, c.openings, c.scene, sky).irradiance({0.5, 2, 1.5}, n).g,
              DirectSky(c.room, c.openings, c.scene, even).irradiance({0.5, 2, 1.5}, n).g, 1e-3)
      << "outside the beam";
}

} // namespace
} // namespace daylit
