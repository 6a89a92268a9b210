// Highlights: what glossy surfaces show of windows and sun, smoothly and with the light that they should have.

#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "glossy_scene.h"
#include "runtime/reflect/glossy_rays.h"
#include "scene/core/orthonormal.h"

namespace daylit {
namespace {

using test::glass;
using test::GlossyScene;
using test::metal;
using test::Surrounded;

/// What a row of points across shows, each with the lobe samples and lights of sixteen pixels: four and four a pixel.
std::vector<double> row(const GlossyScene& scene) {
  std::vector<double> light;
  for (int i = 0; i < 120; ++i) {
    double sum = 0;
    for (int k = 0; k < 16; ++k)
      sum += static_cast<double>(scene.look(-0.14 + 0.28 * i / 119, static_cast<std::size_t>(k), 16, k).radiance.g);
    light.push_back(sum / 16.0);
  }
  return light;
}
double mean(const std::vector<double>& v) { return std::accumulate(v.begin(), v.end(), 0.0) / 120.0; }
/// How far it jumps from one point to the next, relative to the mean.
double roughness(const std::vector<double>& v) {
  double sum = 0;
  for (std::size_t i = 1; i + 1 < v.size(); ++i)
    sum += std::abs(v[i - 1] - 2.0 * v[i] + v[i + 1]);
  return sum / mean(v);
}

/// Integral of f cos L over the half space, of a white metal at every eighth point of row(), evenly over directions.
double mean_integral(const GlossyScene& scene, float alpha) {
  SurfaceMaterial m;
  m.base_colour = Rgb(1.0f);
  m.metallic = 1.0f;
  m.alpha_u = m.alpha_v = alpha;
  const Bsdf bsdf(m);
  double sum = 0;
  for (int i = 0; i < 120; i += 8) {
    const WorldRay ray{scene.middle + glm::dvec3(-1.0, -0.14 + 0.28 * i / 119, 0.0), glm::vec3(1.0f, 0.0f, 0.0f)};
    const auto point = scene.rays->closest(ray, 10.0);
    const glm::dvec3 normal = glm::normalize(point->position - scene.middle);
    const OrthonormalBasis basis(normal);
    const glm::mat3 world(glm::dmat3(basis.u, basis.v, normal));
    const glm::vec3 out = -ray.direction * world;
    constexpr int kCount = 1 << 14;
    for (int n = 0; n < kCount; ++n) {
      const float z = (static_cast<float>(n) + 0.5f) / kCount, r = std::sqrt(1.0f - z * z),
                  angle = 2.3999632f * static_cast<float>(n);
      const glm::vec3 in(r * std::cos(angle), r * std::sin(angle), z);
      const WorldRay onward{point->position + 1e-4 * normal, world * in};
      Rgb seen;
      scene.glossy->radiance({&onward, 1}, {&seen, 1});
      sum += 6.2831853 / (15.0 * kCount) * static_cast<double>(bsdf.glossy(out, in).g * z * seen.g);
    }
  }
  return sum;
}

/// The light is the integral of the BRDF, which light that facets reflect more than once is part of, and hardly jumps
/// from one place to the next.
TEST(GlossyRays, a_rough_metal_shows_a_window_by_lights_and_lobes_as_integrated_and_more_smoothly_than_by_lobes) {
  const std::vector<Aperture> panes = test::box_window();
  GlossyScene scene(metal(0.4f), {}, panes, 30.0f);
  scene.room.set_walls(0.0f);
  const std::vector<double> by_lobes = row(scene);
  scene.look_at_sky_by_lights(panes);
  const std::vector<double> by_both = row(scene);
  const double integral = mean_integral(scene, 0.16f);
  EXPECT_GT(integral, 0.1);
  EXPECT_NEAR(mean(by_both) / integral, 1.0, 0.02);
  EXPECT_LT(roughness(by_both), 0.5 * roughness(by_lobes));
}

/// The far side of frosted glass, met from inside, finds a window by lights. The few samples of its lobe that meet the
/// window say within a quarter the same: light that several facets pass on is wider than they are.
TEST(GlossyRays, frosted_glass_shows_a_window_by_lights_as_by_lobes_alone_but_smoothly) {
  const std::vector<Aperture> panes = test::box_window();
  ObjectMaterial frosted = glass();
  frosted.roughness = 0.4f;
  GlossyScene scene(frosted, {}, panes, 30.0f);
  scene.room.set_walls(0.0f);
  const std::vector<double> by_lobes = row(scene);
  scene.look_at_sky_by_lights(panes);
  const std::vector<double> by_lights = row(scene);
  EXPECT_GT(mean(by_lobes), 0.03);
  EXPECT_NEAR(mean(by_lights) / mean(by_lobes), 1.0, 0.25);
  EXPECT_LT(roughness(by_lights), 0.6 * roughness(by_lobes));
  EXPECT_LT(roughness(by_lights), 5.0); // 5.9 where places in the second lobe follow from those in the first
}

/// From the light into the shadow of a window's edge.
TEST(RoomSeen, four_points_of_the_suns_disc_know_half_shadow_where_its_middle_does_not) {
  GlossyScene scene(metal(0.4f), {}, test::box_window());
  constexpr float kSun = 7.0f;
  scene.sun = DetectedSun{.direction = glm::normalize(glm::dvec3(0.0, 2.5, 0.3)), .normal_irradiance = Rgb(kSun)};
  int part = 0, lit = 0, dark = 0;
  for (int k = 0; k < 2000; ++k) {
    const glm::dvec3 x = scene.middle + glm::dvec3(0.002 * (k - 1000), 0.0, 0.3);
    const float middle = scene.seen->sun_at(x).g, disc = scene.seen->disc_at(x, 0.3).g;
    const bool is_part = disc > 0.0f && disc < 0.99f * kSun;
    part += is_part;
    lit += middle > 0.0f;
    dark += middle == 0.0f;
    if (!is_part) {
      EXPECT_FLOAT_EQ(disc, middle) << k;
    }
  }
  EXPECT_GT(lit, 100);
  EXPECT_GT(dark, 100);
  EXPECT_GT(part, 4);
}

/// A point of frosted glass shows the sun by way of sixty-four points behind it, whose highlights run together; alone,
/// each is a spark, and the row jumps by thirty times its mean.
TEST(GlossyRays, the_sun_behind_frosted_glass_makes_no_sparks) {
  ObjectMaterial frosted = glass();
  frosted.roughness = 0.4f;
  GlossyScene scene(frosted, {}, test::box_window());
  scene.room.set_walls(0.0f);
  scene.sun = DetectedSun{.direction = glm::normalize(glm::dvec3(0.0, 2.5, 0.3)), .normal_irradiance = Rgb(7.0f)};
  const std::vector<double> light = row(scene);
  EXPECT_GT(mean(light), 0.01);
  EXPECT_LT(roughness(light), 10.0);
}

/// A mirror sphere of radius R sends E R^2 / 4 into every direction (geometric optics), however wide the pixels are
/// that see its spot, which is smaller than a pixel.
TEST(GlossyRays, the_suns_spot_on_a_mirror_sphere_has_the_light_that_it_should_have) {
  const std::vector<Aperture> panes = test::box_window();
  for (const float roughness : {0.0f, 0.12f})
    for (const double pixel_m : {0.002, 0.005}) {
      GlossyScene scene(metal(roughness), {}, panes);
      scene.sun = DetectedSun{.direction = glm::normalize(glm::dvec3(0.0, 2.5, 0.3)), .normal_irradiance = Rgb(7.0f)};
      double light = 0;
      const int reach = static_cast<int>(0.14 / pixel_m);
      for (const double shift : {0.05, 0.3, 0.55, 0.8}) // of the grid of pixels
        for (int j = -reach; j <= reach; ++j)
          for (int i = -reach; i <= reach; ++i) {
            const glm::dvec3 aside(-1.0, (i + shift) * pixel_m, (j + 2.0 * shift) * pixel_m);
            const WorldRay ray{scene.middle + aside, glm::vec3(1.0f, 0.0f, 0.0f)};
            const auto point = scene.rays->closest(ray, 10.0);
            if (!point)
              continue;
            const glm::vec2 place(0.5f);
            const CameraPoint at{ray, *point, {&place, 1}, pixel_m};
            GlossyLight seen;
            scene.glossy->look({&at, 1}, {&seen, 1});
            light += 0.25 * static_cast<double>(seen.glint.g) * pixel_m * pixel_m;
          }
      const double r = static_cast<double>(GlossyScene::kRadius);
      EXPECT_NEAR(light / (7.0 * r * r / 4.0), 1.0, 0.1) << roughness << ", pixels of " << pixel_m << " m";
    }
}

TEST(GlossyRays, a_plastic_in_the_sun_is_as_bright_as_its_brdf_says) {
  // Drawn with light from everywhere, the base counts E cos / pi of its reflectance; the rest is the highlight's.
  ObjectMaterial plastic;
  plastic.base_colour = Rgb(0.6f);
  plastic.roughness = 0.5f;
  GlossyScene scene(plastic, {}, test::box_window());
  const glm::dvec3 to_sun = glm::normalize(glm::dvec3(-0.5, 2.5, 0.3));
  scene.sun = DetectedSun{.direction = to_sun, .normal_irradiance = Rgb(7.0f)};
  SurfaceMaterial m;
  m.base_colour = Rgb(0.6f);
  m.alpha_u = m.alpha_v = 0.25f;
  int lit = 0;
  for (const double aside : {-0.02, 0.0, 0.03, 0.06, 0.09, 0.12, 0.14}) {
    const WorldRay ray{scene.middle + glm::dvec3(-1.0, aside, 0.0), glm::vec3(1.0f, 0.0f, 0.0f)};
    const auto point = scene.rays->closest(ray, 10.0);
    ASSERT_TRUE(point);
    const glm::vec3 n = glm::normalize(glm::vec3(point->position - scene.middle));
    const auto frame = OrthonormalBasis(glm::dvec3(n));
    const auto local = [&](const glm::dvec3& w) {
      return glm::vec3(glm::dvec3(glm::dot(w, frame.u), glm::dot(w, frame.v), glm::dot(w, glm::dvec3(n))));
    };
    const glm::vec3 out = local(-glm::dvec3(ray.direction)), in = local(to_sun);
    const Rgb sun = in.z * scene.seen->sun_at(point->position + 1e-4 * glm::dvec3(n));
    const glm::vec2 place(0.5f);
    GlossyLight seen;
    scene.glossy->look(std::vector<CameraPoint>{{ray, *point, {&place, 1}, 1e-5}}, {&seen, 1});
    const float found = seen.diffuse.g * sun.g * std::numbers::inv_pi_v<float> + seen.glint.g;
    const float expected = Bsdf(m).f(out, in).g * sun.g;
    lit += expected > 0.1f;
    EXPECT_NEAR(found, expected, 0.01f * expected) << aside;
  }
  EXPECT_GE(lit, 5);
}

/// Stretched upwards: it bends six times less in one direction than in the other.
void stretch(GlossyScene& scene) {
  constexpr float kLonger = 6.0f;
  ObjectMesh mesh = scene.room.mesh;
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    mesh.positions[v].z *= kLonger;
    mesh.normals[v] = glm::normalize(mesh.normals[v] * glm::vec3(1.0f, 1.0f, 1.0f / kLonger));
  }
  scene.objects.surface = test::place(mesh, scene.middle);
  scene.objects.parts[0].model =
      std::make_shared<const VirtualObjects::Model>(VirtualObjects::Model{mesh, {}, Surrounded::rays_of(mesh)});
  scene.objects.find_bounds(0);
  scene.renew();
}

TEST(GlossyRays, the_suns_highlight_in_a_wide_pixel_is_the_mean_of_those_of_narrow_pixels_in_it) {
  constexpr int kNarrow = 16;
  constexpr double kWide_m = 0.01;
  GlossyScene scene(metal(0.12f), {}, test::box_window());
  scene.sun = DetectedSun{.direction = glm::normalize(glm::dvec3(-0.5, 2.5, 0.3)), .normal_irradiance = Rgb(7.0f)};
  stretch(scene);
  const auto glint = [&](double y, double z, double width_m) {
    const WorldRay ray{scene.middle + glm::dvec3(-1.0, y, z), glm::vec3(1.0f, 0.0f, 0.0f)};
    const auto point = scene.rays->closest(ray, 10.0);
    const glm::vec2 place(0.5f);
    GlossyLight seen;
    if (point)
      scene.glossy->look(std::vector<CameraPoint>{{ray, *point, {&place, 1}, width_m}}, {&seen, 1});
    return static_cast<double>(seen.glint.g);
  };
  double apart = 0.0, all = 0.0;
  for (double y = -0.12; y < 0.12; y += kWide_m)
    for (double z = -0.3; z < 0.3; z += 3.0 * kWide_m) {
      double mean = 0.0;
      for (int k = 0; k < kNarrow * kNarrow; ++k)
        mean += glint(y + ((k % kNarrow + 0.5) / kNarrow - 0.5) * kWide_m,
                      z + ((k / kNarrow + 0.5) / kNarrow - 0.5) * kWide_m, kWide_m / kNarrow) /
                (kNarrow * kNarrow);
      all += mean;
      apart += std::fabs(glint(y, z, kWide_m) - mean);
    }
  EXPECT_GT(all, 1.0);
  EXPECT_LT(apart, 0.08 * all); // 0.11 where parts are twice as wide as the lobe's slope
}

/// Of pixels: mean, and standard deviation over it.
std::array<double, 2> spread_of(const std::vector<double>& pixels) {
  const double mean = std::accumulate(pixels.begin(), pixels.end(), 0.0) / static_cast<double>(pixels.size());
  double square = 0.0;
  for (const double p : pixels)
    square += (p - mean) * (p - mean) / static_cast<double>(pixels.size());
  return {mean, std::sqrt(square) / mean};
}

/// Of 16 pixels that see a ball of rough metal in a mirror, each every `step`-th place of its lobe.
std::array<double, 2> metal_in_a_mirror(const GlossyScene& scene, double aside, std::size_t count, std::size_t step) {
  std::vector<double> light;
  for (std::size_t k = 0; k < count; ++k)
    light.push_back(static_cast<double>(scene.look(aside, k, step, static_cast<int>(k % 16)).radiance.g));
  return spread_of(light);
}

TEST(GlossyRays, a_mirror_shows_rough_metal_as_bright_as_with_many_rays_and_more_smoothly_than_with_one) {
  const std::vector<Aperture> panes = test::box_window();
  const double aside = -static_cast<double>(GlossyScene::kRadius) / std::numbers::sqrt2; // there it looks along -y
  GlossyScene scene(metal(0.0f), {}, panes, 1.0f);
  scene.add(metal(0.3f), scene.middle + glm::dvec3(aside, aside - 0.4, -0.06));
  scene.look_at_sky_by_lights(panes);
  const double four = metal_in_a_mirror(scene, aside, 16, 16)[0];
  scene.place_bits = 12;
  const double many = metal_in_a_mirror(scene, aside, 1024, 1024)[0]; // four each, of 4096
  EXPECT_NEAR(four, many, 0.05 * many);

  GlossyScene in_parts(metal(0.0f)); // every other triangle of the room is black
  Room& room = in_parts.room.volume.room;
  room.materials.push_back({"black", Rgb(0.0f), Rgb(1.0f), false});
  for (std::size_t t = 0; t < room.triangles.size(); t += 2)
    room.triangles[t].material = static_cast<std::uint32_t>(room.materials.size() - 1);
  in_parts.add(metal(0.3f), in_parts.middle + glm::dvec3(aside, aside - 0.4, -0.06));
  EXPECT_LT(metal_in_a_mirror(in_parts, aside, 16, 16)[1], 0.6 * metal_in_a_mirror(in_parts, aside, 16, 64)[1]);
}

} // namespace
} // namespace daylit
