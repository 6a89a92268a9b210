// The coefficients of l = 4: what they add to irradiance, against closed forms; and that a volume with them is the same
// volume, combined by the slow formula.

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "scene/volume/volume_combiner.h"
#include "sh/band4.h"
#include "sh/sh9.h"
#include "tests/scene/plain_compact.h"
#include "tests/scene/volume_kinds.h"

namespace daylit {
namespace {

constexpr double kPi = std::numbers::pi;

/// Radiance sum_l of_band[l] P_l(w.d) over l = 0, 1, 2 and 4.
ShRadiance zonal(const std::array<double, 5>& of_band, const glm::vec3& d) {
  ShRadiance radiance;
  const auto low = sh::evaluate9(d), high = sh::evaluate_band4(d);
  for (std::size_t i = 0; i < 9; ++i) {
    const std::size_t l = i == 0 ? 0 : i < 4 ? 1 : 2;
    radiance.nine[i] = Rgb(static_cast<float>(of_band[l] * 4 * kPi / (2.0 * double(l) + 1))) * low[i];
    radiance.band4[i] = Rgb(static_cast<float>(of_band[4] * 4 * kPi / 9)) * high[i];
  }
  return radiance;
}

std::vector<glm::vec3> normals() {
  std::vector<glm::vec3> list;
  for (int k = 0; k < 500; ++k) {
    const double z = 1 - (k + 0.5) / 250, r = std::sqrt(1 - z * z), turn = 2.4 * k;
    list.emplace_back(r * std::cos(turn), r * std::sin(turn), z);
  }
  return list;
}

TEST(Band4, light_of_a_fourth_power_of_the_cosine_has_exact_irradiance) {
  // t^4 = P_0 / 5 + 4 P_2 / 7 + 8 P_4 / 35. Facing it: 2 pi integral t^5 = pi / 3; beside it: 3 pi / 4 / 6.
  const glm::vec3 d = glm::normalize(glm::vec3(0.3f, -0.5f, 0.7f)), beside = glm::normalize(glm::vec3(0.5f, 0.3f, 0));
  const ShRadiance light = zonal({1.0 / 5, 0, 4.0 / 7, 0, 8.0 / 35}, d);
  EXPECT_NEAR(irradiance(light, d).g, kPi / 3, 1e-5);
  EXPECT_NEAR(irradiance(light, -d).r, kPi / 3, 1e-5);
  EXPECT_NEAR(irradiance(light, beside).b, kPi / 8, 1e-5);
  EXPECT_GT(std::abs(double(irradiance(light.nine, d).g) - kPi / 3), 0.02) << "nine coefficients are off";
}

TEST(Band4, halves_what_nine_coefficients_leave_of_a_small_patch) {
  // A cap of radiance 1 within 8 degrees of d: band l is (P_{l-1} - P_{l+1})(cos 8 degrees) / 2.
  const double t = std::cos(8 * kPi / 180);
  std::array<double, 6> p{1, t};
  for (std::size_t l = 2; l < 6; ++l)
    p[l] = ((2.0 * double(l) - 1) * t * p[l - 1] - (double(l) - 1) * p[l - 2]) / double(l);
  std::array<double, 5> band{};
  for (std::size_t l = 0; l < 5; ++l)
    band[l] = 0.5 * ((l == 0 ? 1.0 : p[l - 1]) - p[l + 1]);
  const glm::vec3 d = glm::normalize(glm::vec3(-0.2f, 0.4f, 0.5f));
  const ShRadiance light = zonal(band, d);
  EXPECT_NEAR(irradiance(zonal({band[0], band[1], 0, 0, 0}, d), d).g, kPi * (band[0] + 2 * band[1] / 3), 1e-5);
  double nine = 0, all = 0;
  for (const glm::vec3& n : normals()) {
    const double cosine = glm::dot(n, d), limit = std::sin(8 * kPi / 180);
    if (std::abs(cosine) < limit) // partly below the horizon
      continue;
    const double exact = kPi * (1 - t * t) * std::max(cosine, 0.0);
    nine += std::pow(double(irradiance(light.nine, n).g) - exact, 2);
    all += std::pow(double(irradiance(light, n).g) - exact, 2);
  }
  EXPECT_LT(std::sqrt(all), 0.55 * std::sqrt(nine));
}

TEST(Band4, windowed_light_is_nowhere_negative_and_calm_light_keeps_every_bit) {
  ShRadiance light = zonal({1.0 / 5, 0, 4.0 / 7, 0, 8.0 / 35}, {0, 0, 1});
  for (std::size_t i = 0; i < 9; ++i) {
    light.nine[i].r = i == 0 ? 0.3f : 0.1f * light.nine[i].r;
    light.band4[i].r *= 12.0f; // alone it is below zero somewhere
  }
  const NonNegativeLight calm = without_ringing(light);
  EXPECT_EQ(calm.windowed_channels, 1);
  float before = 1, nine = 1, after = 1;
  for (const glm::vec3& n : normals()) {
    before = std::min(before, irradiance(light, n).r);
    nine = std::min(nine, irradiance(light.nine, n).r);
    after = std::min(after, irradiance(calm.radiance, n).r);
  }
  EXPECT_LT(before, -0.01f);
  EXPECT_GT(nine, 0.0f) << "only the added band rings";
  EXPECT_GT(after, -1e-5f);
  EXPECT_GT(calm.bias, 0.01);
  for (std::size_t i = 0; i < 9; ++i) {
    EXPECT_EQ(calm.radiance.nine[i].g, light.nine[i].g);
    EXPECT_EQ(calm.radiance.band4[i].b, light.band4[i].b);
  }
}

void expect_near(const std::vector<Band4Rgb>& a, const std::vector<Band4Rgb>& b, double tolerance) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t p = 0; p < a.size(); ++p)
    for (std::size_t m = 0; m < 9; ++m)
      for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(a[p][m][c], b[p][m][c], tolerance) << p << " " << m;
}

std::vector<Rgb> sky_of(const BasisVolume& volume) {
  std::vector<Rgb> radiance;
  for (int r = 0; r < volume.partition.size(); ++r)
    radiance.emplace_back(0.3f + 0.1f * float(r % 5), 0.2f, r % 3 == 0 ? 0.0f : 1.0f);
  return radiance;
}

TEST(Band4, factors_are_combined_as_the_file_defines_them) {
  for (const int colours : {1, 3}) {
    const BasisVolume volume = test::with_band4(test::compact_volume(colours));
    const CompactBasis& basis = *volume.compact;
    const std::vector<Rgb> radiance = sky_of(volume);
    const LightField field = combine(volume, radiance, ShOrder::fourth);
    const auto nine = test::plain_field(basis, basis.nine, radiance, volume.probes.size()),
               band4 = test::plain_field(basis, basis.band4, radiance, volume.probes.size());
    const auto largest = [](const auto& probes) {
      double most = 0;
      for (const auto& probe : probes)
        for (const Rgb& x : probe)
          most = std::max(most, std::abs(double(x.g)));
      return most;
    };
    EXPECT_GT(largest(nine), 1.0);
    EXPECT_GT(largest(band4), 0.1);
    expect_near(field.probe, nine, 1e-6 * largest(nine));
    expect_near(field.band4, band4, 1e-6 * largest(band4));
    EXPECT_EQ(field.band4[5], Band4Rgb{}) << "in no cluster";
  }
}

TEST(Band4, nine_coefficients_keep_every_bit_and_are_read_alone) {
  for (const BasisVolume& plain : {test::plain_volume(), test::compact_volume(1), test::compact_volume(3)}) {
    const BasisVolume volume = test::with_band4(plain);
    const std::vector<Rgb> radiance = sky_of(volume);
    const LightField without = combine(plain, radiance, ShOrder::fourth), nine = combine(volume, radiance),
                     all = combine(volume, radiance, ShOrder::fourth);
    EXPECT_EQ(nine.probe, without.probe);
    EXPECT_EQ(all.probe, without.probe);
    EXPECT_TRUE(nine.band4.empty() && without.band4.empty());
    EXPECT_EQ(all.band4.size(), volume.probes.size());
  }
}

TEST(Band4, combiner_gives_the_field_of_the_plain_combination) {
  for (const BasisVolume& plain : {test::plain_volume(), test::compact_volume(1)}) {
    const BasisVolume volume = test::with_band4(plain);
    VolumeCombiner exact = VolumeCombiner::make(volume, ShOrder::fourth), nine = VolumeCombiner::make(volume);
    std::vector<Rgb> radiance = sky_of(volume);
    for (const float brighter : {1.0f, 3.0f}) { // linear in the sky, by steps too
      radiance[2] *= brighter;
      EXPECT_GT(exact.update(radiance), 0u);
      nine.update(radiance);
      expect_near(exact.field().band4, combine(volume, radiance, ShOrder::fourth).band4, 1e-4);
      EXPECT_EQ(exact.field().probe, nine.field().probe);
    }
    EXPECT_EQ(exact.update(radiance), 0u);
    EXPECT_TRUE(nine.field().band4.empty());
  }
}

TEST(Band4, rows_of_constant_regions_are_combined_like_those_of_the_nine) {
  BasisVolume volume = test::plain_volume();
  for (const float x : volume.basis)
    volume.band4.push_back(2 * x);
  const LightField field = combine(volume, sky_of(volume), ShOrder::fourth);
  for (std::size_t p = 0; p < field.probe.size(); ++p)
    for (std::size_t i = 0; i < 9; ++i)
      EXPECT_EQ(field.band4[p][i], 2.0f * field.probe[p][i]);
}

TEST(Band4, both_parts_are_interpolated_by_the_same_weights) {
  BasisVolume volume = test::plain_volume();
  for (const float x : volume.basis)
    volume.band4.push_back(2 * x);
  const auto sampler = LightFieldSampler::make(volume);
  ASSERT_TRUE(sampler);
  const LightField field = combine(volume, sky_of(volume), ShOrder::fourth), nine = combine(volume, sky_of(volume));
  const glm::dvec3 at = volume.probes.origin + glm::dvec3(volume.probes.positions[0]) + 0.4 * volume.probes.spacing;
  const auto all = sampler->sample_all(field, at), low = sampler->sample_all(nine, at);
  ASSERT_TRUE(all && low);
  EXPECT_EQ(all->nine, *sampler->sample(field, at));
  for (std::size_t i = 0; i < 9; ++i)
    EXPECT_EQ(all->band4[i], 2.0f * all->nine[i]);
  EXPECT_EQ(low->band4, Band4Rgb{});
}

} // namespace
} // namespace daylit
