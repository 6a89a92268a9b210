// Light that elements near a point send it: against the solid angle of a rectangle, and as a correction between probes.

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "scene/volume/first_reflection.h"
#include "scene/volume/volume_file.h"
#include "tests/scene/test_rooms.h"
#include "tests/scene/test_volumes.h"

namespace daylit {
namespace {

/// A sheet of 1 x 1 m at z = 0 in two elements that face up; a grid of 3 x 2 x 2 probes above it, the middle ones
/// interpolated. `roof`: a sheet at z = 0.05 that hides the other.
struct Sheet {
  test::RoomBuilder builder;
  BasisVolume volume;
  RayScene scene;

  explicit Sheet(bool roof = false) : volume(test::grid_volume(test::closed_room(), {3, 2, 2}, 2)) {
    const auto grey = builder.material("grey");
    builder.quad({0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, grey);
    if (roof)
      builder.quad({-9, -9, 0.05}, {9, -9, 0.05}, {9, 9, 0.05}, {-9, 9, 0.05}, grey);
    scene = *RayScene::build(builder.room);
    ProbeSet& probes = volume.probes;
    probes.origin = glm::dvec3(0.0);
    for (std::size_t i = 0; i < probes.size(); ++i)
      probes.positions[i] = {0.3f * static_cast<float>(i % 3), 0.5f + 0.3f * static_cast<float>(i / 3 % 2),
                             0.1f + 0.3f * static_cast<float>(i / 6)};
    probes.spacing = glm::dvec3(0.3);
    probes.valid.assign(probes.size(), 1);
    probes.interpolated.assign(probes.size(), 0);
    for (std::size_t i = 1; i < probes.size(); i += 3) {
      probes.interpolated[i] = 1;
      probes.valid[i] = 0;
    }
    auto compact = std::make_shared<CompactBasis>();
    compact->light = {1, {1.0f, 1.0f}, {0, 1, 2}, {0, 0}, std::vector<std::uint16_t>(16, 0)};
    compact->light.weight[0] = compact->light.weight[8] = 0x3c00; // 1 of the first node
    compact->light_unit = {2.0f, 3.0f};
    volume.compact = compact;
    volume.elements = {{{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}}}, {{{0, 0, 0}, {1, 1, 0}, {0, 1, 0}}}},
                       {Rgb(0.5f), Rgb(0.4f)}};
  }

  ShRadiance sent(const glm::dvec3& x, float radiance) const {
    return FirstReflection::make(volume, scene)
        ->correction(x, {}, {}, std::vector<Rgb>(2, Rgb(1.0f)),
                     [&](std::size_t, const FirstReflection::Triangle&) { return Rgb(radiance); });
  }
};

constexpr glm::dvec3 kAbove{0.4, 0.45, 0.02};

/// Solid angle of an a x b rectangle from a point d above one of its corners: atan(ab / (d sqrt(a^2 + b^2 + d^2))).
double corner_solid_angle(double a, double b, double d) {
  return std::atan(a * b / (d * std::sqrt(a * a + b * b + d * d)));
}

TEST(FirstReflection, mean_light_of_a_sheet_is_its_solid_angle) {
  const Sheet sheet;
  for (const double d : {0.005, 0.02, 0.1, 0.4}) {
    double omega = 0;
    for (const double a : {0.4, 0.6})
      for (const double b : {0.45, 0.55})
        omega += corner_solid_angle(a, b, d);
    // L_00 = L omega Y_00
    const ShRadiance light = sheet.sent({0.4, 0.45, d}, 3.0f);
    EXPECT_NEAR(static_cast<double>(light.nine[0].g), 3.0 * omega * 0.28209479, 0.02 * 3.0 * omega * 0.28209479) << d;
  }
}

TEST(FirstReflection, nothing_comes_from_behind_or_through_a_sheet) {
  EXPECT_EQ(Sheet().sent({0.4, 0.45, -0.1}, 3.0f).nine[0], Rgb(0.0f));
  EXPECT_EQ(Sheet(true).sent({0.4, 0.45, 0.1}, 3.0f).nine[0], Rgb(0.0f));
}

TEST(FirstReflection, light_as_it_is_stored_needs_no_correction_at_a_probe) {
  const Sheet sheet;
  const std::vector<Rgb> stored{Rgb(2.0f), Rgb(5.0f)};
  const std::array<std::uint32_t, 1> probe{2};
  const std::array<float, 1> weight{1.0f};
  const ShRadiance left = FirstReflection::make(sheet.volume, sheet.scene)
                              ->correction(glm::dvec3(sheet.volume.probes.positions[2]), probe, weight, stored,
                                           [&](std::size_t e, const FirstReflection::Triangle&) { return stored[e]; });
  for (std::size_t k = 0; k < 9; ++k) {
    EXPECT_EQ(left.nine[k], Rgb(0.0f));
    EXPECT_EQ(left.band4[k], Rgb(0.0f));
  }
}

TEST(FirstReflection, an_interpolated_probe_has_the_light_of_those_beside_it) {
  const Sheet sheet;
  const auto surfaces = FirstReflection::make(sheet.volume, sheet.scene);
  const std::vector<Rgb> stored(2, Rgb(1.0f));
  const auto none = [](std::size_t, const FirstReflection::Triangle&) { return Rgb(0.0f); };
  const auto of = [&](std::vector<std::uint32_t> probe, std::vector<float> weight) {
    return surfaces->correction(kAbove, probe, weight, stored, none).nine;
  };
  const auto between = of({1, 3}, {1.0f, 0.0f}), beside = of({0, 2, 3}, {0.5f, 0.5f, 0.0f});
  EXPECT_LT(between[0].g, 0.0f); // what is stored is taken out
  for (std::size_t k = 0; k < 9; ++k)
    EXPECT_NEAR(between[k].g, beside[k].g, 1e-5f) << k;
}

TEST(FirstReflection, an_exchange_gives_the_correction_of_elements_that_are_lit_evenly) {
  const Sheet sheet;
  const auto surfaces = FirstReflection::make(sheet.volume, sheet.scene);
  const std::array<std::uint32_t, 3> probe{1, 2, 3};
  const std::array<float, 3> weight{0.5f, 0.2f, 0.3f};
  const std::vector<Rgb> stored{Rgb(2.0f, 1.0f, 0.5f), Rgb(5.0f, 6.0f, 7.0f)}, actual{Rgb(3.0f), Rgb(1.0f, 2.0f, 4.0f)};
  const ShRadiance wanted = surfaces->correction(
      kAbove, probe, weight, stored, [&](std::size_t e, const FirstReflection::Triangle&) { return actual[e]; });
  const auto exchange = surfaces->exchange(kAbove, probe, weight, stored);
  const ShRadiance got = FirstReflection::correction(exchange, stored, actual);
  EXPECT_GT(std::abs(wanted.nine[0].g), 0.1f);
  for (std::size_t k = 0; k < 9; ++k)
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(got.nine[k][c], wanted.nine[k][c], 1e-4f) << k;
      EXPECT_NEAR(got.band4[k][c], wanted.band4[k][c], 1e-4f) << k;
    }
}

TEST(FirstReflection, radiance_of_an_element_is_reflectance_times_its_irradiance_over_pi) {
  const Sheet sheet;
  const std::vector<Rgb> light =
      FirstReflection::make(sheet.volume, sheet.scene)->radiance(std::vector<Rgb>(8, Rgb(7.0f)));
  EXPECT_NEAR(light[0].r, 7.0f * 2.0f * 0.5f / std::numbers::pi_v<float>, 1e-5f);
  EXPECT_NEAR(light[1].r, 7.0f * 3.0f * 0.4f / std::numbers::pi_v<float>, 1e-5f);
}

TEST(FirstReflection, elements_of_a_simplified_room_are_seen_though_they_lie_behind_the_room) {
  Sheet sheet;
  test::RoomBuilder folds; // that the sheet stands for: half of them before it
  folds.quad({0, 0, 0.01}, {1, 0, 0.01}, {1, 1, 0.01}, {0, 1, 0.01}, folds.material("grey"));
  sheet.volume.room = folds.room;
  const glm::dvec3 above{0.4, 0.45, 0.1};
  const ShRadiance wanted = sheet.sent(above, 3.0f);
  sheet.scene = *rays_of_light(sheet.volume);
  EXPECT_EQ(sheet.sent(above, 3.0f).nine[0].g, 0.0f);
  sheet.volume.simplified = {sheet.builder.room.vertices, {}};
  for (const RoomTriangle& t : sheet.builder.room.triangles)
    sheet.volume.simplified.triangles.push_back(t.vertex);
  sheet.scene = *rays_of_light(sheet.volume);
  EXPECT_EQ(sheet.sent(above, 3.0f).nine[0].g, wanted.nine[0].g);
}

TEST(FirstReflection, a_volume_that_does_not_name_its_elements_is_not_corrected) {
  Sheet sheet;
  sheet.volume.elements = {};
  EXPECT_FALSE(FirstReflection::make(sheet.volume, sheet.scene));
}

} // namespace
} // namespace daylit
