// What metals send to the room, against closed forms.

#include <gtest/gtest.h>

#include "runtime/base/octahedral.h"
#include "scene/material/material.h"
#include "surrounded.h"

namespace daylit {
namespace {

using test::kPi;
using test::Surrounded;

/// Nine coefficients of L(w) = a + b w.z.
Sh9Rgb gradient(float a, float b) {
  Sh9Rgb light{};
  light[0] = Rgb(a * 2.0f * std::sqrt(std::numbers::pi_v<float>));
  light[2] = Rgb(b * 2.0f * std::sqrt(std::numbers::pi_v<float> / 3.0f));
  return light;
}

/// Evenly over the sphere.
std::vector<glm::vec3> directions() {
  constexpr int kSide = 48;
  std::vector<glm::vec3> all;
  for (int j = 0; j < kSide; ++j)
    for (int i = 0; i < kSide; ++i)
      all.emplace_back(octahedral_direction((glm::dvec2(i, j) + 0.5) * (2.0 / kSide) - 1.0));
  return all;
}

TEST(MirroredLight, what_is_mirrored_comes_from_the_mirrored_direction) {
  const MirroredLight light({{MirroringSide{gradient(3.0f, 2.0f), Rgb(0.0f), Rgb(1.0f)}, MirroringSide{}}}, {});
  for (const glm::vec3& w : directions())
    EXPECT_NEAR(light.change(0, MirroredLight::direction_of(w)).g, 3.0f + 2.0f * w.z - 1.0f, 2.0f * 0.18f)
        << "texels are 13 degrees wide, their corners up to 10 from the middle";
  EXPECT_EQ(light.change(1, MirroredLight::direction_of({0, 0, 1})), Rgb(0.0f)) << "a side that mirrors nothing";
}

TEST(MirroredLight, a_window_is_mirrored_from_where_it_is_with_all_of_its_light) {
  const glm::dvec3 to_window = glm::normalize(glm::dvec3(1.0, 2.0, 0.5));
  const MirroredLight light({{MirroringSide{{}, Rgb(1.0f), Rgb(1e-6f)}, MirroringSide{}}},
                            std::vector<DirectionalLight>{{to_window, Rgb(5.0f)}});
  const std::vector<glm::vec3> all = directions();
  double sum = 0.0;
  for (const glm::vec3& w : all) {
    const float found = light.change(0, MirroredLight::direction_of(w)).g;
    sum += 4.0 * kPi / static_cast<double>(all.size()) * static_cast<double>(found);
    if (glm::dot(glm::dvec3(w), to_window) < 0.5) {
      EXPECT_LT(found, 0.01f) << "60 degrees from the window";
    }
  }
  EXPECT_NEAR(sum, 5.0, 0.02 * 5.0);
}

TEST(MirroredLight, a_small_mirroring_sphere_sends_to_all_sides_the_mean_of_what_arrives_from_all) {
  // Seen from far away the mirrored directions are spread evenly over the sphere of directions: it looks as bright as
  // the mean of L(w) = a + a w.z, which is a; a diffuse one is dark from below. From h below: a ray t off the axis
  // meets the sphere at the angle s to the normal, sin s = h / r sin t, and what it shows comes from t + pi - 2 s off
  // the axis.
  Surrounded s(0.1f);
  const glm::dvec3 at(2.0, 2.5, 1.2), below(2.0, 2.5, 0.0);
  glm::dmat4 world(1.0);
  world[3] = glm::dvec4(at, 1.0);
  s.change.set_objects(
      {{&s.mesh_rays, s.mesh.triangles, s.mesh.positions, 0, world, nullptr, Rgb(0.0f), {}, s.mesh.normals}});
  s.change.set_sky(s.pyramid, {});
  constexpr float kDiffuse = 1.5f, kMean = 6.0f;
  const ObjectSurface surface = test::place(s.mesh, at);
  s.change.set_direct(std::vector<TwoSided>(s.mesh.positions.size(), {Rgb(kDiffuse), Rgb(kDiffuse)}), surface,
                      surface.reflectance);
  MirroringSide side{gradient(kMean, kMean), Rgb(0.0f), Rgb(kDiffuse)};
  s.change.set_mirrored(std::vector<std::array<MirroringSide, 2>>(s.mesh.positions.size(), {side, side}), {});
  s.change.set_indirect(std::vector<TwoSided>(s.mesh.positions.size()));
  const double form_factor = 0.1 * 0.1 / (1.2 * 1.2), far = kPi * form_factor * (6.0 - Surrounded::kRadiance);
  double expected = 0.0;
  constexpr int kSteps = 1000;
  for (int k = 0; k < kSteps; ++k) { // even steps of sin^2 t
    const double sine = std::sqrt((k + 0.5) / kSteps * form_factor), t = std::asin(sine);
    const double shown = 6.0 + 6.0 * std::cos(t + kPi - 2.0 * std::asin(1.2 / 0.1 * sine));
    expected += kPi * form_factor / kSteps * (shown - Surrounded::kRadiance);
  }
  EXPECT_NEAR(expected, far, 0.1 * far);
  const IndirectChange exact = s.change.evaluate(s.floor_at(below), below, {0, 0, -1}, 4096);
  EXPECT_NEAR(exact.irradiance.g, expected, 0.03 * expected);
  EXPECT_NEAR(s.at(below).irradiance.g, exact.irradiance.g, 0.06 * expected) << "24 rays in the place of 4096";
}

TEST(MirroredLight, of_a_metal_what_is_not_rough_is_mirrored) {
  ObjectMaterial m;
  m.base_colour = Rgb(0.8f);
  m.metallic = 1.0f;
  m.roughness = 0.0f;
  EXPECT_EQ(mean_mirrored_reflectance(m), mean_reflectance(m));
  m.roughness = 0.5f;
  EXPECT_NEAR(mean_mirrored_reflectance(m).g, 0.75f * mean_reflectance(m).g, 1e-6f);
  m.anisotropy = 1.0f;
  EXPECT_EQ(mean_mirrored_reflectance(m), Rgb(0.0f)) << "brushed: as rough as can be one way";
  m.metallic = 0.0f;
  m.anisotropy = 0.0f;
  EXPECT_EQ(mean_mirrored_reflectance(m), Rgb(0.0f)) << "plastic";
}

} // namespace
} // namespace daylit
