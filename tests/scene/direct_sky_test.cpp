#include "scene/sky/direct_sky.h"

#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "scene/room/aperture.h"
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

/// A room with all that can stand in the way: a table, a box, a column of many facets, a sheet outside, glass in two
/// sheets in one of two holes, a sill with thickness.
Room furnished_room() {
  test::RoomBuilder b;
  const auto grey = b.material("grey");
  const auto glass = b.material("window_glass", Rgb(0), Rgb(0.9f, 0.8f, 0.7f));
  b.room.materials[glass].refractive_index = 1.52f;
  b.box({0, 0, 0}, {4, 5, 3}, grey, 63 & ~(4u | 8u));
  b.wall_with_hole(0, 0, 4, 0, 3, 1, 3, 1, 2, grey);
  b.wall_with_hole(5, 0, 4, 0, 3, 2, 3.5, 0.9, 2.4, grey);
  for (const double y : {5.0, 5.03})
    b.quad({2, y, 0.9}, {3.5, y, 0.9}, {3.5, y, 2.4}, {2, y, 2.4}, glass);
  b.box({1.2, 1.0, 0.7}, {2.6, 1.8, 0.74}, grey);    // table top
  b.box({0.3, 2.5, 0.0}, {1.1, 3.1, 1.2}, grey);     // box
  b.box({0.9, -0.8, 1.55}, {3.1, -0.02, 1.6}, grey); // overhang outside
  for (int k = 0; k < 120; ++k) {                    // column
    const double a = 2 * kPi * k / 120, c = 2 * kPi * (k + 1) / 120, r = 0.2;
    const glm::dvec3 at(2.9, 3.2, 0), p(r * std::cos(a), r * std::sin(a), 0), q(r * std::cos(c), r * std::sin(c), 0);
    b.quad(at + p, at + q, at + q + glm::dvec3(0, 0, 2.8), at + p + glm::dvec3(0, 0, 2.8), grey);
  }
  return b.room;
}

/// The slow twin: one ray for each of n x n directions, evenly in cosine-weighted solid angle.
Rgb direct_by_rays(const Case& c, const Sky& sky, const glm::dvec3& point, const glm::dvec3& normal, int n) {
  const glm::dvec3 t =
      std::abs(normal.z) < 0.9 ? glm::normalize(glm::cross(normal, glm::dvec3(0, 0, 1))) : glm::dvec3(1, 0, 0);
  const glm::dvec3 b = glm::cross(normal, t), from = point + 1e-4 * normal;
  glm::dvec3 sum(0.0);
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < n; ++k) {
      const double r = std::sqrt((i + 0.5) / n), a = 2 * kPi * (k + 0.5 + 0.37 * (i % 7) / 7.0) / n;
      const glm::dvec3 d = r * std::cos(a) * t + r * std::sin(a) * b + std::sqrt(1 - r * r) * normal;
      int crossed = 0;
      const Rgb through = aperture_transmittance(c.openings, from, d, INFINITY, &crossed);
      if (crossed > 0 && !c.scene.occluded(c.scene.to_local(from), glm::vec3(d), 0.0f, INFINITY))
        sum += glm::dvec3(through) * glm::dvec3(sky.radiance(d));
    }
  return Rgb(kPi * sum / static_cast<double>(n * n));
}

TEST(DirectSky, agrees_with_rays_in_a_furnished_room) {
  const Case c(furnished_room());
  ASSERT_EQ(c.openings.size(), 3u); // a hole, two sheets of glass
  SkyModel model;
  model.kind = SkyModel::Kind::general;
  model.distribution = *cie_sky(12);
  model.sun = SunDisc{glm::normalize(glm::dvec3(0.3, -1, 0.8)), 0.00465, Rgb(0.0f)};
  const Sky sky(model);
  const DirectSky direct(c.room, c.openings, c.scene, sky);
  double error = 0, power = 0;
  for (const glm::dvec3& p :
       {glm::dvec3(2, 2.4, 0.5), {1.9, 1.4, 0.02}, {3.5, 4.2, 1.1}, {0.5, 4.0, 2.0}, {2.9, 2.7, 1.4}})
    for (const glm::dvec3& n : {glm::dvec3(0, -1, 0), {0, 1, 0}, {0, 0, 1}, {0.6, 0, -0.8}}) {
      const glm::dvec3 fast(direct.irradiance(p, n)), slow(direct_by_rays(c, sky, p, n, 500));
      const glm::dvec3 d = fast - slow;
      error += glm::dot(d, d);
      power += glm::dot(slow, slow);
      EXPECT_LE(glm::length(d), 0.01 * glm::length(slow) + 2e-4) << p.x << " " << p.y << " " << p.z << " n " << n.y;
    }
  EXPECT_LE(std::sqrt(error / power), 5e-3); // what 250,000 rays are off; 4.4 million: 6e-4
}

TEST(DirectSky, free_sun_of_a_description_has_its_normal_irradiance) {
  const Case c(room_with_hole().room);
  SkyModel model;
  model.kind = SkyModel::Kind::uniform;
  model.zenith_radiance = Rgb(0.0f);
  model.ground_albedo = 0.0f;
  model.sun = SunDisc{glm::normalize(glm::dvec3(0.13, -1.0, 0.21)), 0.00465, Rgb(800.0f)};
  const Sky sky(model);
  const DirectSky direct(c.room, c.openings, c.scene, sky);
  EXPECT_NEAR(direct.irradiance({2, 2, 1.5}, model.sun->direction).g / 800.0f, 1.0f, 1e-6f);
  const glm::dvec3 n(0, -1, 0);
  EXPECT_NEAR(direct.irradiance({2, 2, 1.5}, n).g / (800.0f * static_cast<float>(glm::dot(n, model.sun->direction))),
              1.0f, 1e-6f);
  EXPECT_EQ(direct.irradiance({0.5, 2, 1.5}, n), Rgb(0.0f)) << "outside the beam";
}

// The sun is cut by the upper edge of the window: the part of a disc beyond a chord h from its middle is
// (acos x - x sqrt(1 - x^2)) / pi, x = h / r.
TEST(DirectSky, sun_at_the_edge_of_a_window_counts_with_its_visible_part) {
  const Case c(room_with_hole().room); // upper edge z = 2 in y = 0
  SkyModel model;
  model.kind = SkyModel::Kind::uniform;
  model.zenith_radiance = Rgb(0.0f);
  model.ground_albedo = 0.0f;
  const glm::dvec3 p(2, 3, 1), edge = glm::normalize(glm::dvec3(2, 0, 2) - p),
                               up(0, 1 / std::sqrt(10), 3 / std::sqrt(10));
  ASSERT_NEAR(glm::dot(edge, up), 0.0, 1e-12);
  const double radius = 0.00465;
  for (const double x : {-0.9, -0.3, 0.0, 0.5, 0.95}) { // middle above the edge by x radii
    model.sun = SunDisc{glm::normalize(edge + x * radius * up), radius, Rgb(1000.0f)};
    const Sky sky(model);
    const glm::dvec3 normal = edge;
    // The element stands 0.1 mm above its surface, which shifts the edge.
    const double seen = (std::acos(x) - x * std::sqrt(1 - x * x)) / kPi;
    const double e = static_cast<double>(DirectSky(c.room, c.openings, c.scene, sky).irradiance(p, normal).g) / 1000.0;
    EXPECT_NEAR(e, seen, 1e-3) << x;
  }
}

TEST(DirectSky, uniform_sky_is_exact_through_two_holes_and_behind_a_box) {
  // E at a point facing a hole of which a parallel sheet hides the lower half: view factors are sums of corners.
  test::RoomBuilder b = room_with_hole();
  b.quad({0, 1, 0}, {4, 1, 0}, {4, 1, 1.5}, {0, 1, 1.5}, 0); // sheet, upper edge at eye height
  const Case c(b.room);
  SkyModel model;
  model.kind = SkyModel::Kind::uniform;
  model.ground_albedo = -1.0f;
  model.ground_radiance = Rgb(1.0f);
  const Sky sky(model);
  const DirectSky direct(c.room, c.openings, c.scene, sky);
  const double leave = 1e-4, expected = kPi * 2.0 * corner_factor(1.0, 0.5, 2.0 - leave);
  EXPECT_NEAR(glm::dvec3(direct.irradiance({2, 2, 1.5}, {0, -1, 0})).g / expected, 1.0, 1e-6);
}

} // namespace
} // namespace daylit
