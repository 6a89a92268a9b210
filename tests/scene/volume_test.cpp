#include "scene/volume/volume.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "tests/scene/test_volumes.h"
#include "tests/scene/volume_kinds.h"

namespace daylit {
namespace {

using test::grid_volume;
using test::random_radiance;
using test::RoomBuilder;

LightField combine_reference(const BasisVolume& volume, std::span<const Rgb> radiance) {
  LightField field;
  for (std::size_t p = 0; p < volume.probes.size(); ++p)
    for (std::size_t lm = 0; lm < 9; ++lm) {
      glm::dvec3 sum(0.0);
      for (std::size_t r = 0; r < volume.stored_region.size(); ++r)
        for (int c = 0; c < 3; ++c)
          sum[c] += static_cast<double>(volume.basis[((r * volume.probes.size() + p) * 9 + lm) * 3 + c]) *
                    static_cast<double>(radiance[volume.stored_region[r]][c]);
      if (lm == 0)
        field.probe.emplace_back();
      field.probe[p][lm] = Rgb(sum);
    }
  return field;
}

double largest_difference(const LightField& a, const LightField& b) {
  double largest = 0.0;
  for (std::size_t p = 0; p < a.probe.size(); ++p)
    for (std::size_t lm = 0; lm < 9; ++lm)
      largest = std::max(largest, static_cast<double>(glm::length(a.probe[p][lm] - b.probe[p][lm])));
  return largest;
}

/// A field whose first coefficient is the given function of place.
template <class F>
LightField field_of(const BasisVolume& volume, F value) {
  LightField field;
  for (std::size_t i = 0; i < volume.probes.size(); ++i)
    field.probe.push_back(
        {Rgb(static_cast<float>(value(volume.probes.origin + glm::dvec3(volume.probes.positions[i]))))});
  return field;
}

TEST(Volume, combine_equals_reference_loop) {
  // 1, 5 and 129 probes end in every kind of partial tile; the volume keeps 41 of 64 regions.
  for (const glm::ivec3 count : {glm::ivec3(1), glm::ivec3(5, 1, 1), glm::ivec3(43, 3, 1), glm::ivec3(8, 8, 8)}) {
    const BasisVolume volume = grid_volume(test::closed_room(), count, 41);
    const std::vector<Rgb> radiance = random_radiance(volume, 7);
    const double scale = 20.0; // of the sums: 41 terms of size one times ten
    EXPECT_LT(largest_difference(combine(volume, radiance), combine_reference(volume, radiance)), 1e-5 * scale);
  }
}

TEST(Volume, combine_is_linear) {
  const BasisVolume volume = grid_volume(test::closed_room(), {4, 5, 3}, 64);
  const std::vector<Rgb> a = random_radiance(volume, 1), b = random_radiance(volume, 2);
  std::vector<Rgb> mix;
  for (std::size_t i = 0; i < a.size(); ++i)
    mix.push_back(2.0f * a[i] + 0.5f * b[i]);
  const LightField of_a = combine(volume, a), of_b = combine(volume, b), of_mix = combine(volume, mix);
  for (std::size_t p = 0; p < volume.probes.size(); ++p)
    for (std::size_t lm = 0; lm < 9; ++lm)
      EXPECT_LT(glm::length(of_mix.probe[p][lm] - 2.0f * of_a.probe[p][lm] - 0.5f * of_b.probe[p][lm]), 1e-3f);
}

TEST(Volume, black_sky_gives_black_field_and_unstored_regions_give_nothing) {
  const BasisVolume volume = grid_volume(test::closed_room(), {4, 5, 3}, 10);
  std::vector<Rgb> radiance(volume.partition.size(), Rgb(0.0f));
  EXPECT_EQ(largest_difference(combine(volume, radiance), combine_reference(volume, radiance)), 0.0);
  radiance.back() = Rgb(1e6f); // the test volumes store the first rows only
  for (const Sh9Rgb& probe : combine(volume, radiance).probe)
    EXPECT_EQ(probe, Sh9Rgb{});
}

TEST(Volume, combine_gives_the_same_bits_on_one_and_many_threads) {
  const BasisVolume volume = grid_volume(test::closed_room(), {12, 12, 12}, 20);
  const std::vector<Rgb> radiance = random_radiance(volume, 3);
  const LightField many = combine(volume, radiance);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(largest_difference(combine(volume, radiance), many), 0.0);
}

TEST(Volume, uniform_radiance_has_irradiance_pi) {
  Sh9Rgb uniform{};
  uniform[0] = Rgb(2.0f * std::sqrt(std::numbers::pi_v<float>)); // L_00 = integral Y_00 = 4 pi / (2 sqrt pi)
  for (const glm::vec3 n : {glm::vec3(0, 0, 1), glm::vec3(0.6f, -0.8f, 0)})
    EXPECT_NEAR(irradiance(uniform, n).g, std::numbers::pi, 1e-5);
}

TEST(Sampler, interpolation_reproduces_a_linear_field) {
  const BasisVolume volume = grid_volume(test::closed_room(), {6, 7, 5}, 1);
  const auto value = [](const glm::dvec3& p) { return 1.0 + 0.3 * p.x - 0.7 * p.y + 0.2 * p.z; };
  const LightField field = field_of(volume, value);
  const auto sampler = LightFieldSampler::make(volume);
  ASSERT_TRUE(sampler) << sampler.error().message();
  std::mt19937 random(5);
  const glm::dvec3 first = glm::dvec3(volume.probes.positions.front()),
                   last = glm::dvec3(volume.probes.positions.back());
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int i = 0; i < 1000; ++i) {
    const glm::dvec3 p =
        volume.probes.origin + glm::mix(first, last, glm::dvec3(unit(random), unit(random), unit(random)));
    const auto sh = sampler->sample(field, p);
    ASSERT_TRUE(sh);
    EXPECT_NEAR((*sh)[0].r, value(p), 2e-5);
  }
}

TEST(Sampler, weights_are_positive_and_sum_to_one) {
  const BasisVolume volume = grid_volume(test::room_with_table(), {6, 7, 5}, 1);
  const auto sampler = LightFieldSampler::make(volume);
  ASSERT_TRUE(sampler);
  std::mt19937 random(6);
  std::uniform_real_distribution<double> x(0.001, 3.999), y(0.001, 4.999), z(0.001, 2.999);
  for (int i = 0; i < 2000; ++i) {
    std::array<std::uint32_t, 8> probe;
    std::array<float, 8> weight;
    const int used = sampler->weights({x(random), y(random), z(random)}, probe, weight);
    ASSERT_LE(used, 8);
    float sum = 0.0f;
    for (int k = 0; k < used; ++k) {
      EXPECT_GT(weight[k], 0.0f);
      EXPECT_EQ(volume.probes.valid[probe[k]], 1);
      sum += weight[k];
    }
    EXPECT_TRUE(used == 0 || std::abs(sum - 1.0f) < 1e-5f);
  }
}

TEST(Sampler, cells_without_surfaces_need_no_rays_and_agree_with_rays) {
  // The same grid in an empty and in a furnished room: away from the table both give the trilinear weights.
  const auto empty = LightFieldSampler::make(grid_volume(test::closed_room(), {6, 7, 5}, 1));
  const auto furnished = LightFieldSampler::make(grid_volume(test::room_with_table(), {6, 7, 5}, 1));
  ASSERT_TRUE(empty && furnished);
  std::array<std::uint32_t, 8> probe_a, probe_b;
  std::array<float, 8> a, b;
  ASSERT_EQ(empty->weights({0.9, 4.0, 2.0}, probe_a, a), 8);
  ASSERT_EQ(furnished->weights({0.9, 4.0, 2.0}, probe_b, b), 8);
  EXPECT_EQ(probe_a, probe_b);
  EXPECT_EQ(a, b);
}

TEST(Sampler, point_behind_a_thin_wall_gets_no_light_from_the_other_side) {
  // A sheet at x = 2.1 parts a bright (x < 2.1) from a dark half; it lies between two columns of probes.
  RoomBuilder b;
  const auto grey = b.material("grey");
  b.box({0, 0, 0}, {4, 5, 3}, grey);
  b.quad({2.1, 0, 0}, {2.1, 5, 0}, {2.1, 5, 3}, {2.1, 0, 3}, grey);
  const BasisVolume regular = grid_volume(b.room, {5, 6, 4}, 1);
  for (const BasisVolume& volume : {regular, test::graded(regular, 0.3)}) {
    const LightField field = field_of(volume, [](const glm::dvec3& p) { return p.x < 2.1 ? 1.0 : 0.0; });
    const auto sampler = LightFieldSampler::make(volume);
    ASSERT_TRUE(sampler);
    for (int i = 0; i < 40; ++i) {
      const double y = 0.05 + 0.12 * i, z = 0.05 + 0.07 * i;
      for (const double x : {2.102, 2.11, 2.3, 2.45, 3.9})
        EXPECT_EQ((*sampler->sample(field, {x, y, z}))[0].r, 0.0f) << x << " " << y << " " << z;
      for (const double x : {2.098, 2.09, 1.9, 1.7, 0.1})
        EXPECT_NEAR((*sampler->sample(field, {x, y, z}))[0].r, 1.0f, 1e-6f) << x << " " << y << " " << z;
    }
  }
}

TEST(Sampler, no_light_comes_through_a_thin_table_top) {
  // Bright below the top at z = 0.72 (1 cm thick, between two layers of probes), dark above. Round the edges light
  // may come: only points whose cell lies wholly over the top are asked.
  RoomBuilder b;
  const auto grey = b.material("grey");
  b.box({0, 0, 0}, {4, 5, 3}, grey);
  b.box({0.8, 1.2, 0.72}, {3.2, 3.8, 0.73}, grey);
  const BasisVolume volume = grid_volume(b.room, {9, 11, 7}, 1);
  const LightField field = field_of(volume, [](const glm::dvec3& p) { return p.z < 0.725 ? 1.0 : 0.0; });
  const auto sampler = LightFieldSampler::make(volume);
  ASSERT_TRUE(sampler);
  int above = 0;
  for (double x = 1.3; x < 2.7; x += 0.11)
    for (double y = 1.7; y < 3.3; y += 0.13) {
      for (const double z : {0.7305, 0.74, 0.8, 0.95}) {
        EXPECT_EQ((*sampler->sample(field, {x, y, z}))[0].r, 0.0f) << x << " " << y << " " << z;
        ++above;
      }
      for (const double z : {0.7195, 0.71, 0.65, 0.55})
        EXPECT_NEAR((*sampler->sample(field, {x, y, z}))[0].r, 1.0f, 1e-6f) << x << " " << y << " " << z;
    }
  EXPECT_GT(above, 500);
}

TEST(Sampler, outside_and_inside_furniture_there_is_no_light_field) {
  RoomBuilder b = test::room_with_hole();
  b.box({1, 2, 0}, {2, 3, 1}, 0, 63 & ~16u); // a box without bottom, as large as a grid cell
  BasisVolume volume = grid_volume(b.room, {5, 6, 4}, 1);
  volume.apertures = {{{{1, 0, 1}, {1, 0, 2}, {3, 0, 2}, {3, 0, 1}}, {0, 1, 0}, Rgb(1)}};
  for (std::size_t i = 0; i < volume.probes.size(); ++i) {
    const glm::dvec3 p = volume.probes.origin + glm::dvec3(volume.probes.positions[i]);
    if (p.x > 1 && p.x < 2 && p.y > 2 && p.y < 3 && p.z < 1)
      volume.probes.valid[i] = 0;
  }
  const auto sampler = LightFieldSampler::make(volume);
  ASSERT_TRUE(sampler);
  std::array<std::uint32_t, 8> probe;
  std::array<float, 8> weight;
  const auto inside = [&](glm::dvec3 p) { return sampler->weights(p, probe, weight) > 0; };
  EXPECT_FALSE(inside({1.5, 2.5, 0.5}));
  EXPECT_FALSE(inside({1.05, 2.05, 0.95}));
  EXPECT_FALSE(inside({2, -0.01, 1.5})) << "before the hole";
  EXPECT_FALSE(inside({2, -3, 1.5}));
  EXPECT_FALSE(inside({-0.01, 2, 1}));
  EXPECT_FALSE(inside({2, 2, -0.01}));
  EXPECT_FALSE(inside({2, 2, 1e6}));
  EXPECT_FALSE(inside({2, 2, std::nan("")}));
  EXPECT_TRUE(inside({2, 0.01, 1.5}));
  EXPECT_TRUE(inside({0.001, 0.001, 0.001}));
  EXPECT_TRUE(inside({3, 4, 0.0})) << "a point on the floor belongs to the room";
  EXPECT_TRUE(inside({1.5, 2.5, 1.0})) << "and so does one on the box";
}

TEST(Sampler, narrow_gap_without_corner_in_sight_takes_the_next_ring) {
  // A shaft 0.2 m wide along z, between two boards; the probes of the cell are all outside it, those above see in.
  RoomBuilder b;
  const auto grey = b.material("grey");
  b.box({0, 0, 0}, {4, 5, 3}, grey);
  b.box({1.6, 1.6, 0}, {1.8, 1.8, 0.9}, grey, 15u);
  const BasisVolume volume = grid_volume(b.room, {5, 6, 4}, 1);
  const auto sampler = LightFieldSampler::make(volume);
  ASSERT_TRUE(sampler);
  std::array<std::uint32_t, 8> probe;
  std::array<float, 8> weight;
  EXPECT_GT(sampler->weights({1.7, 1.7, 0.8}, probe, weight), 0);
}

TEST(Sampler, free_points_answer_only_where_they_are) {
  BasisVolume volume = grid_volume(test::closed_room(), {5, 6, 4}, 1);
  volume.probes.is_grid = false;
  volume.probes.valid[3] = 0;
  const auto sampler = LightFieldSampler::make(volume);
  ASSERT_TRUE(sampler);
  std::array<std::uint32_t, 8> probe;
  std::array<float, 8> weight;
  for (std::uint32_t i = 0; i < volume.probes.size(); ++i) {
    const glm::dvec3 p = volume.probes.origin + glm::dvec3(volume.probes.positions[i]);
    ASSERT_EQ(sampler->weights(p + 5e-5, probe, weight), i == 3 ? 0 : 1);
    EXPECT_TRUE(i == 3 || probe[0] == i);
    EXPECT_EQ(sampler->weights(p + glm::dvec3(2e-4, 0, 0), probe, weight), 0);
  }
}

TEST(Sampler, grid_that_does_not_fit_its_probes_is_refused) {
  BasisVolume volume = grid_volume(test::closed_room(), {5, 6, 4}, 1);
  volume.probes.count.x = 6;
  EXPECT_FALSE(LightFieldSampler::make(volume));
  volume.probes.count.x = 5;
  volume.probes.positions[7].y += 0.1f;
  EXPECT_FALSE(LightFieldSampler::make(volume));
}

TEST(WithoutRinging, irradiance_is_nowhere_negative_and_calm_light_keeps_every_bit) {
  Sh9Rgb light{};
  light[0] = Rgb(1.0f);
  light[2] = {1.9f, 0.2f, 0.0f};
  light[6] = {1.9f, 0.1f, 0.0f}; // red: nearly a point source above, E turns negative at the sides
  const NonNegativeLight calm = without_ringing({light, {}});
  EXPECT_EQ(calm.windowed_channels, 1);
  EXPECT_GT(calm.bias, 0.01);
  EXPECT_EQ(calm.radiance.nine[0], light[0]);
  float before = 1, after = 1;
  for (int k = 0; k < 2000; ++k) {
    const double z = 1 - (k + 0.5) / 1000, r = std::sqrt(1 - z * z), turn = 2.4 * k;
    const glm::vec3 n(r * std::cos(turn), r * std::sin(turn), z);
    before = std::min(before, irradiance(light, n).r);
    after = std::min(after, irradiance(calm.radiance, n).r);
  }
  EXPECT_LT(before, -0.01f);
  EXPECT_GT(after, -1e-5f);
  for (std::size_t i = 0; i < 9; ++i) {
    EXPECT_EQ(calm.radiance.nine[i].g, light[i].g);
    EXPECT_EQ(calm.radiance.nine[i].b, light[i].b);
  }
}

TEST(Volume, radiance_of_regions_that_do_not_count_changes_no_bit) {
  std::ptrdiff_t left_out = 0;
  for (const test::VolumeKind& v : test::volume_kinds()) {
    const std::vector<std::uint8_t> counts = regions_that_count(v.volume);
    ASSERT_EQ(counts.size(), static_cast<std::size_t>(v.volume.partition.size())) << v.name;
    left_out += std::ranges::count(counts, 0);
    const std::vector<Rgb> radiance = random_radiance(v.volume, 3);
    std::vector<Rgb> only = radiance;
    for (std::size_t r = 0; r < only.size(); ++r)
      if (!counts[r])
        only[r] = Rgb(0.0f);
    const LightField all = combine(v.volume, radiance, ShOrder::fourth),
                     some = combine(v.volume, only, ShOrder::fourth);
    EXPECT_EQ(all.probe, some.probe) << v.name;
    EXPECT_EQ(all.band4, some.band4) << v.name;
  }
  EXPECT_GT(left_out, 0);
}

} // namespace
} // namespace daylit
