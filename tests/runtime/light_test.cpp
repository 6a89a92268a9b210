#include <gtest/gtest.h>

#include <random>

#include "runtime/base/sh_rotation.h"
#include "runtime/object/relight.h"
#include "runtime/sky/direct_light.h"
#include "runtime/sky/window_sampler.h"
#include "scene/room/glass.h"
#include "sh/sh9.h"
#include "test_scene.h"

namespace daylit {
namespace {

constexpr double kPi = std::numbers::pi;

glm::dvec3 random_direction(std::mt19937& rng) {
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  while (true) {
    const glm::dvec3 d(uniform(rng), uniform(rng), uniform(rng));
    if (const double r = glm::length(d); r > 0.1 && r < 1.0)
      return d / r;
  }
}

TEST(WindowCone, allows_every_ray_from_the_sphere_through_a_window) {
  std::mt19937 rng(7);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  const auto windows = test::box_window();
  for (const BoundingSphere& sphere :
       {BoundingSphere{{2, 2, 1}, 0.3}, BoundingSphere{{0.4, 4.6, 0.3}, 0.35}, BoundingSphere{{2, 4.9, 0.9}, 0.4}}) {
    const WindowCone cone(windows, sphere);
    for (int k = 0; k < 5000; ++k) {
      const glm::dvec3 x = sphere.centre + sphere.radius * std::cbrt(uniform(rng)) * random_direction(rng);
      const glm::dvec3 p(1.2 + 1.6 * uniform(rng), 5.0, 0.9 + 1.2 * uniform(rng));
      if (x.y < 5.0 - 1e-9) {
        ASSERT_TRUE(cone.allows(glm::normalize(p - x), 1e-9));
      }
    }
  }
}

TEST(WindowCone, rejects_directions_that_pass_beside_the_window) {
  const WindowCone cone(test::box_window(), {{2, 2, 1}, 0.1});
  EXPECT_FALSE(cone.allows({0, -1, 0}));
  EXPECT_FALSE(cone.allows(glm::normalize(glm::dvec3(2, 1, 0))));
  EXPECT_FALSE(cone.allows(glm::normalize(glm::dvec3(0, 1, 1))));
  EXPECT_TRUE(cone.allows(glm::normalize(glm::dvec3(0, 3, 0.5))));
}

TEST(WindowSampler, density_integrates_to_one_and_matches_its_samples) {
  const SkyMap map = test::overcast_sky(64);
  const WindowCone cone(test::box_window(), {{2, 2, 1}, 0.2});
  const WindowSampler sampler(map, cone);
  double integral = 0.0;
  for (int y = 0; y < map.height; ++y)
    for (int x = 0; x < map.width; ++x)
      integral += sampler.window_pdf(map.direction(x + 0.5, y + 0.5)) * map.solid_angle_sr(y);
  EXPECT_NEAR(integral, 1.0, 1e-12);
  for (int j = 0; j < 200; ++j) {
    const glm::dvec2 u = lattice_point(j, 200);
    const WindowSample s = sampler.sample_window(u);
    EXPECT_NEAR(glm::length(s.direction), 1.0, 1e-12);
    EXPECT_NEAR(sampler.window_pdf(s.direction), s.pdf, 1e-9 * s.pdf);
    const glm::dvec2 back = sampler.invert_window(s.direction);
    EXPECT_NEAR(back.x, u.x, 1e-9);
    EXPECT_NEAR(back.y, u.y, 1e-9);
    EXPECT_GT(luminance(s.radiance), 0.0f);
  }
}

TEST(WindowSampler, never_samples_a_black_texel_or_a_black_sky) {
  SkyMap map = test::overcast_sky(64);
  std::fill(map.radiance.begin(), map.radiance.end(), Rgb(0.0f));
  const WindowCone cone(test::box_window(), {{2, 2, 1}, 0.2});
  EXPECT_TRUE(WindowSampler(map, cone).empty());
  const glm::dvec2 p = map.position(glm::normalize(glm::dvec3(0, 3, 0.5)));
  map.radiance[static_cast<std::size_t>(p.y) * map.width + static_cast<std::size_t>(p.x)] = Rgb(1e9f);
  const WindowSampler one(map, cone);
  ASSERT_EQ(one.texel_count(), 1u);
  EXPECT_EQ(one.sample_window({0.999999, 0.999999}).radiance, Rgb(1e9f));
}

TEST(DirectLight, clipped_samples_lose_no_light) {
  // Irradiance at points all over the object, with the samples alone, against the integral over the window.
  const SkyMap map = test::overcast_sky();
  const auto pyramid = sky_map_pyramid(map);
  const auto windows = test::box_window();
  const BoundingSphere sphere{{2.0, 3.0, 0.4}, 0.3};
  const LightSet lights = sample_lights(map, std::nullopt, windows, sphere, 8192);
  const auto cells = aperture_cells(windows, sphere, pyramid);
  std::mt19937 rng(3);
  const glm::dvec3 n(0, 1, 0);
  for (int k = 0; k < 20; ++k) {
    const glm::dvec3 x = sphere.centre + sphere.radius * random_direction(rng);
    double sum = 0.0;
    for (const DirectionalLight& l : lights.sky) {
      const double t = (5.0 - x.y) / l.direction.y;
      const glm::dvec3 p = x + t * l.direction;
      if (t > 0 && p.x > 1.2 && p.x < 2.8 && p.z > 0.9 && p.z < 2.1)
        sum += static_cast<double>(l.irradiance.g) * glm::dot(n, l.direction);
    }
    const double exact = static_cast<double>(open_sky_irradiance(pyramid, cells, x, n).g);
    EXPECT_NEAR(sum / exact, 1.0, 0.01) << "point " << k;
  }
}

TEST(DirectLight, cells_integrate_a_uniform_sky_to_the_polygon_form_factor) {
  // Parallel rectangle 2a x 2b centred in front of a differential element at distance d (Howell C-11, four corners):
  // F = 2/pi [A/sqrt(1+A^2) atan(B/sqrt(1+A^2)) + B/sqrt(1+B^2) atan(A/sqrt(1+B^2))], A = a/d, B = b/d.
  SkyMap map = test::overcast_sky(64);
  std::fill(map.radiance.begin(), map.radiance.end(), Rgb(1.0f));
  const auto pyramid = sky_map_pyramid(map);
  const auto cells = aperture_cells(test::box_window(), {{2, 3, 1.5}, 0.1}, pyramid);
  const double a = 0.8 / 2.0, b = 0.6 / 2.0, p = std::sqrt(1 + a * a), q = std::sqrt(1 + b * b);
  const double factor = 2.0 / kPi * (a / p * std::atan(b / p) + b / q * std::atan(a / q));
  const double e = static_cast<double>(open_sky_irradiance(pyramid, cells, {2, 3, 1.5}, {0, 1, 0}).g);
  EXPECT_NEAR(e / (kPi * factor), 1.0, 2e-3);
}

/// Lambert's formula (Cohen & Wallace 1993, eq. 4.9): E / L = 1/2 sum over the sides of angle x (normal of the side's
/// triangle with x).n, of a polygon above the horizon of n.
double polygon_irradiance(const std::vector<glm::dvec3>& corners, const glm::dvec3& x, const glm::dvec3& n) {
  double sum = 0.0;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const glm::dvec3 a = glm::normalize(corners[k] - x), b = glm::normalize(corners[(k + 1) % corners.size()] - x);
    sum += std::acos(glm::dot(a, b)) * glm::dot(glm::normalize(glm::cross(a, b)), n);
  }
  return 0.5 * std::fabs(sum);
}

TEST(DirectLight, beside_a_window_cells_are_cut_until_they_agree_with_lamberts_formula) {
  SkyMap map = test::overcast_sky(64);
  std::fill(map.radiance.begin(), map.radiance.end(), Rgb(1.0f));
  const auto pyramid = sky_map_pyramid(map);
  const auto windows = test::box_window();
  const auto cells = aperture_cells(windows, {{2, 1, 1.0}, 0.1}, pyramid); // 20 and 27 cm wide
  const glm::dvec3 up(0, 0, 1);
  for (const double away : {0.003, 0.01, 0.03, 0.1, 0.3, 1.0}) {
    const glm::dvec3 sill(1.7, 5.0 - away, 0.9 - 1e-9);
    const double exact = polygon_irradiance(windows[0].corners, sill, up);
    EXPECT_NEAR(static_cast<double>(open_sky_irradiance(pyramid, cells, sill, up).g) / exact, 1.0, 0.03) << away;
    const std::vector<glm::dvec3> x{sill};
    const std::vector<glm::vec3> n{glm::vec3(up)};
    EXPECT_NEAR(static_cast<double>(open_sky_irradiance(pyramid, cells, x, n)[0].g) / exact, 1.0, 0.03) << away;
  }
}

TEST(DirectLight, cells_of_clear_glass_dim_each_ray_by_its_angle) {
  auto windows = test::box_window();
  windows[0].refractive_index = 1.52f;
  SkyMap map = test::overcast_sky(64);
  std::fill(map.radiance.begin(), map.radiance.end(), Rgb(1.0f));
  const auto pyramid = sky_map_pyramid(map);
  const auto ratio = [&](const glm::dvec3& x, const glm::dvec3& n) {
    const BoundingSphere sphere{x, 0.05};
    const auto glass = aperture_cells(windows, sphere, pyramid),
               open = aperture_cells(test::box_window(), sphere, pyramid);
    return static_cast<double>(open_sky_irradiance(pyramid, glass, x, n).g /
                               open_sky_irradiance(pyramid, open, x, n).g);
  };
  EXPECT_NEAR(ratio({2, 0.2, 1.5}, {0, 1, 0}), clear_slab_transmittance(1.0, 1.52), 1e-3); // nearly normal
  const glm::dvec3 aside(-8, 2.2, 1.5), way = glm::normalize(glm::dvec3(2, 5, 1.5) - aside);
  EXPECT_NEAR(ratio(aside, way), clear_slab_transmittance(way.y, 1.52), 0.01); // 74 degrees
}

TEST(DirectLight, panes_in_series_count_their_light_once) {
  auto windows = test::box_window(Rgb(0.8f));
  windows.push_back({{{1.2, 4.9, 0.9}, {2.8, 4.9, 0.9}, {2.8, 4.9, 2.1}, {1.2, 4.9, 2.1}}, {0, -1, 0}, Rgb(0.5f)});
  SkyMap map = test::overcast_sky(64);
  std::fill(map.radiance.begin(), map.radiance.end(), Rgb(1.0f));
  const auto pyramid = sky_map_pyramid(map);
  const BoundingSphere sphere{{2, 2, 1.5}, 0.1};
  const auto open = [&](const std::vector<Aperture>& list) {
    const auto cells = aperture_cells(list, sphere, pyramid);
    return static_cast<double>(open_sky_irradiance(pyramid, cells, sphere.centre, {0, 1, 0}).g);
  };
  EXPECT_NEAR(open(windows) / open(test::box_window()), 0.4, 0.02); // the rim is seen through one of the two only
}

SkyImage sky_with_disc(const glm::dvec3& sun, double radius, float disc, float sky) {
  RgbImage image(512, 256, Rgb(sky));
  for (int y = 0; y < 256; ++y)
    for (int x = 0; x < 512; ++x) {
      int inside = 0;
      for (int k = 0; k < 64; ++k) {
        const double theta = kPi * (y + (k / 8 + 0.5) / 8) / 256, phi = 2 * kPi * (0.5 - (x + (k % 8 + 0.5) / 8) / 512);
        const glm::dvec3 d(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
        inside += glm::dot(d, sun) > std::cos(radius);
      }
      image.at(x, y) += Rgb(disc * static_cast<float>(inside) / 64.0f);
    }
  return *SkyImage::make(std::move(image), EquirectProjection{});
}

Rgb energy(const SkyImage& sky) {
  glm::dvec3 sum(0.0);
  for (std::size_t i = 0; i < sky.image().texels.size(); ++i)
    sum += static_cast<double>(sky.solid_angle_sr()[i]) * glm::dvec3(sky.image().texels[i]);
  return Rgb(sum);
}

TEST(Sun, is_taken_out_of_the_sky_with_its_exact_energy) {
  const glm::dvec3 direction = glm::normalize(glm::dvec3(0.3, -0.7, 0.5));
  const SkyImage sky = sky_with_disc(direction, kSunAngularRadius, 1e5f, 1.0f);
  const SkyResampler resampler = SkyResampler::make(sky, 256);
  const auto sun = find_sun(sky, resampler.pixel_directions());
  ASSERT_TRUE(sun);
  EXPECT_LT(std::acos(glm::dot(sun->direction, direction)), 0.004); // a third of a pixel: the disc is smaller than one
  SkyMap map;
  resampler.resample(sky, &*sun, map);
  glm::dvec3 left(0.0);
  for (int y = 0; y < map.height; ++y)
    for (int x = 0; x < map.width; ++x)
      left += map.solid_angle_sr(y) * glm::dvec3(map.at(x, y));
  EXPECT_NEAR((left.g + static_cast<double>(sun->normal_irradiance.g)) / static_cast<double>(energy(sky).g), 1.0, 1e-5);
  EXPECT_LT(luminance(map.interpolate(direction)), 1.5f);
  const LightSet lights = sample_lights(map, sun, test::box_window(), {{2, 2, 1}, 0.3}, 64);
  EXPECT_TRUE(lights.sun_found);
  EXPECT_TRUE(lights.sun.empty()) << "the sun stands behind the room";
}

TEST(Sun, lights_carry_its_energy_and_stay_in_its_disc) {
  DetectedSun sun;
  sun.direction = glm::normalize(glm::dvec3(0.1, 1.0, 0.2));
  sun.normal_irradiance = Rgb(3.0f, 2.0f, 1.0f);
  const LightSet lights = sample_lights(test::overcast_sky(64), sun, test::box_window(), {{2, 2, 1}, 0.3}, 64);
  ASSERT_EQ(lights.sun.size(), 16u);
  EXPECT_EQ(lights.size(), 64u);
  Rgb sum(0.0f);
  for (const DirectionalLight& l : lights.sun) {
    sum += l.irradiance;
    EXPECT_LT(std::acos(std::min(glm::dot(l.direction, sun.direction), 1.0)), kSunAngularRadius + 1e-6);
  }
  EXPECT_NEAR(sum.r, 3.0f, 1e-5f);
}

TEST(Sun, a_uniform_or_black_sky_has_none) {
  const SkyImage uniform = sky_with_disc({0, 0, 1}, 0.0, 0.0f, 1.0f), black = sky_with_disc({0, 0, 1}, 0.0, 0.0f, 0.0f);
  const SkyResampler resampler = SkyResampler::make(uniform, 64);
  EXPECT_FALSE(find_sun(uniform, resampler.pixel_directions()));
  EXPECT_FALSE(find_sun(black, resampler.pixel_directions()));
}

TEST(SkyMap, pyramid_keeps_the_energy) {
  const auto levels = sky_map_pyramid(test::overcast_sky(128));
  ASSERT_GE(levels.size(), 5u);
  for (const SkyMap& level : levels) {
    double sum = 0.0;
    for (int y = 0; y < level.height; ++y)
      for (int x = 0; x < level.width; ++x)
        sum += level.solid_angle_sr(y) * static_cast<double>(level.at(x, y).g);
    // Upper half: (1 + 2 z) / 3 integrates to 4 pi / 3; lower half 0.2 x 2 pi. Texel centres stand for texels.
    EXPECT_NEAR(sum / (4.0 * kPi / 3.0 + 0.4 * kPi), 1.0, 1e-3);
  }
}

TEST(SkyMap, memory_of_another_frame_leaves_nothing_behind) {
  const glm::dvec3 direction = glm::normalize(glm::dvec3(0.3, -0.7, 0.5));
  const SkyImage first = sky_with_disc(direction, kSunAngularRadius, 1e5f, 1.0f),
                 second = sky_with_disc(-direction, 0.3, 2.0f, 0.5f);
  const SkyResampler resampler = SkyResampler::make(first, 128);
  const auto sun = find_sun(first, resampler.pixel_directions());
  ASSERT_TRUE(sun);
  std::vector<SkyMap> kept(1);
  resampler.resample(first, &*sun, kept[0]);
  halve_sky_map(kept);
  resampler.resample(second, nullptr, kept[0]);
  halve_sky_map(kept);
  SkyMap map;
  resampler.resample(second, nullptr, map);
  const auto fresh = sky_map_pyramid(map);
  ASSERT_EQ(kept.size(), fresh.size());
  for (std::size_t k = 0; k < fresh.size(); ++k)
    EXPECT_EQ(kept[k].radiance, fresh[k].radiance) << "level " << k;
}

TEST(ShRotation, a_rotated_function_takes_the_rotated_values) {
  std::mt19937 rng(11);
  std::uniform_real_distribution<float> uniform(-1.0f, 1.0f);
  for (int trial = 0; trial < 20; ++trial) {
    std::array<float, 9> f;
    for (float& c : f)
      c = uniform(rng);
    const glm::dvec3 a = random_direction(rng), b = glm::normalize(glm::cross(a, random_direction(rng)));
    const glm::mat3 r(glm::vec3(a), glm::vec3(b), glm::vec3(glm::cross(a, b)));
    const std::array<float, 9> turned = rotate9<float>(r, f);
    for (int k = 0; k < 10; ++k) {
      const glm::vec3 w(random_direction(rng)), from = glm::transpose(r) * w;
      const auto yw = sh::evaluate9<float>(w), yf = sh::evaluate9<float>(from);
      float left = 0.0f, right = 0.0f;
      for (int i = 0; i < 9; ++i) {
        left += turned[i] * yw[i];
        right += f[i] * yf[i];
      }
      EXPECT_NEAR(left, right, 2e-6f);
    }
  }
}

TEST(Relight, ringing_is_drawn_as_no_light_and_its_share_is_reported) {
  // Nine coefficients of a unit of irradiance from +z: E(n) = 1/4 + z/2 + 5/32 (3 z^2 - 1), negative around z = -0.5.
  const auto irradiance = [](double z) { return 0.25 + 0.5 * z + 5.0 / 32.0 * (3.0 * z * z - 1.0); };
  const auto from_above = sh::evaluate9<float>(glm::vec3(0, 0, 1));
  LightField field{std::vector<Sh9Rgb>(1)};
  for (int c = 0; c < 9; ++c)
    field.probe[0][c] = Rgb(from_above[c], 0.0f, 0.0f);
  constexpr int kVertices = 1001;
  std::vector<VertexProbes> probes(kVertices);
  std::vector<VertexTransfer> transfer(kVertices);
  double negative = 0, positive = 0;
  std::size_t count = 0;
  for (int i = 0; i < kVertices; ++i) {
    const float z = -1.0f + 2.0f * static_cast<float>(i) / (kVertices - 1);
    probes[i].weight[0] = 1.0f;
    probes[i].count = 1;
    const auto y = sh::evaluate9<float>(glm::vec3(std::sqrt(std::max(1.0f - z * z, 0.0f)), 0.0f, z));
    for (int c = 0; c < 9; ++c)
      transfer[i].front[c] = sh::kClampedCosine9<float>[c] * y[c];
    const double e = irradiance(z);
    (e < 0 ? negative : positive) += std::abs(e);
    count += e < 0;
  }
  Ringing ringing;
  const auto radiance =
      relight_vertices(light_between(field, probes), transfer, std::vector<Rgb>(kVertices, Rgb(0.5f)), &ringing);
  for (int i = 0; i < kVertices; ++i)
    EXPECT_NEAR(radiance[i].front.r, 0.5 / kPi * std::max(irradiance(-1.0 + 2.0 * i / (kVertices - 1)), 0.0), 1e-6);
  EXPECT_GT(count, 100u);
  EXPECT_NEAR(static_cast<double>(ringing.vertices), static_cast<double>(count), 2.0);
  EXPECT_NEAR(ringing.added_fraction, negative / positive, 1e-5);
}

} // namespace
} // namespace daylit
