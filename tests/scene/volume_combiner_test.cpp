// Sky after sky against the formula, and the rules by which work is skipped.

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "scene/volume/volume_combiner.h"
#include "tests/scene/test_volumes.h"

namespace daylit {
namespace {

BasisVolume volume_of(glm::ivec3 count, int rows) { return test::grid_volume(test::closed_room(), count, rows); }

double largest_difference(const LightField& a, const LightField& b) {
  double most = 0;
  for (std::size_t p = 0; p < a.probe.size(); ++p)
    for (std::size_t l = 0; l < 9; ++l)
      for (int c = 0; c < 3; ++c)
        most = std::max(most, std::abs(static_cast<double>(a.probe[p][l][c]) - static_cast<double>(b.probe[p][l][c])));
  return most;
}

double largest_value(const LightField& a) { return largest_difference(a, {std::vector<Sh9Rgb>(a.probe.size())}); }

bool same_bits(const LightField& a, const LightField& b) {
  return a.probe.size() == b.probe.size() &&
         std::memcmp(a.probe.data(), b.probe.data(), a.probe.size() * sizeof(Sh9Rgb)) == 0;
}

/// The slow twin: sum over regions of radiance times basis, in double.
LightField plain_combination(const BasisVolume& volume, std::span<const Rgb> radiance) {
  LightField field{std::vector<Sh9Rgb>(volume.probes.size())};
  for (std::size_t k = 0; k < volume.row_floats(); ++k) {
    const int c = static_cast<int>(k % 3);
    double sum = 0;
    for (std::size_t r = 0; r < volume.stored_region.size(); ++r)
      sum += double(radiance[static_cast<std::size_t>(volume.stored_region[r])][c]) *
             double(volume.basis[r * volume.row_floats() + k]);
    field.probe[k / 27][k % 27 / 3][c] = static_cast<float>(sum);
  }
  return field;
}

TEST(VolumeCombiner, field_is_the_sum_of_radiance_times_basis) {
  for (const glm::ivec3 count : {glm::ivec3(1, 1, 1), glm::ivec3(3, 2, 2), glm::ivec3(5, 7, 6)})
    for (const int rows : {1, 5, 64}) {
      const BasisVolume volume = volume_of(count, rows);
      const auto radiance = test::random_radiance(volume, 3);
      const LightField expected = plain_combination(volume, radiance);
      VolumeCombiner combiner = VolumeCombiner::make(volume);
      EXPECT_EQ(combiner.update(radiance), static_cast<std::size_t>(rows));
      EXPECT_LT(largest_difference(combiner.field(), expected), 5e-7 * largest_value(expected) * std::sqrt(rows));
      EXPECT_TRUE(same_bits(combiner.field(), combine(volume, radiance)));
    }
}

TEST(VolumeCombiner, unchanged_radiances_read_nothing_and_keep_every_bit) {
  const BasisVolume volume = volume_of({5, 4, 3}, 64);
  const auto radiance = test::random_radiance(volume, 5);
  VolumeCombiner c = VolumeCombiner::make(volume);
  c.update(radiance);
  const LightField before = c.field();
  EXPECT_EQ(c.update(radiance), 0u);
  EXPECT_TRUE(same_bits(c.field(), before));
}

TEST(VolumeCombiner, black_regions_are_skipped_without_changing_a_bit) {
  const BasisVolume volume = volume_of({5, 4, 3}, 64);
  auto radiance = test::random_radiance(volume, 6);
  for (std::size_t r = 0; r < radiance.size(); r += 3)
    radiance[r] = Rgb(0.0f);
  BasisVolume without = volume; // rows of black regions hold other numbers: they must not be looked at
  for (std::size_t r = 0; r < radiance.size(); r += 3)
    for (std::size_t k = 0; k < volume.row_floats(); ++k)
      without.basis[r * volume.row_floats() + k] = 1e30f;
  VolumeCombiner a = VolumeCombiner::make(volume), b = VolumeCombiner::make(without);
  EXPECT_EQ(a.update(radiance), 42u);
  b.update(radiance);
  EXPECT_TRUE(same_bits(a.field(), b.field()));
}

TEST(VolumeCombiner, steps_read_the_changed_rows_only_and_do_not_drift) {
  const BasisVolume volume = volume_of({5, 4, 3}, 64);
  auto radiance = test::random_radiance(volume, 8);
  VolumeCombiner c = VolumeCombiner::make(volume);
  c.update(radiance);
  std::mt19937 random(9);
  std::uniform_real_distribution<float> ten(0.0f, 10.0f);
  std::size_t full = 0;
  for (int step = 0; step < 600; ++step) {
    radiance[random() % 64] = {ten(random), ten(random), ten(random)};
    radiance[random() % 64].g = ten(random);
    const std::size_t rows = c.update(radiance);
    full += rows > 2 ? 1 : 0;
  }
  EXPECT_EQ(full, 2u); // after every 256 steps
  const LightField expected = combine(volume, radiance);
  EXPECT_LT(largest_difference(c.field(), expected), 1e-5 * largest_value(expected)); // sqrt(88 steps) roundings
}

TEST(VolumeCombiner, bits_do_not_depend_on_the_thread_count) {
  const BasisVolume volume = volume_of({16, 16, 16}, 64);
  const auto radiance = test::random_radiance(volume, 10);
  VolumeCombiner many = VolumeCombiner::make(volume), one = VolumeCombiner::make(volume);
  many.update(radiance);
  const tbb::global_control single(tbb::global_control::max_allowed_parallelism, 1);
  one.update(radiance);
  EXPECT_TRUE(same_bits(many.field(), one.field()));
}

} // namespace
} // namespace daylit
