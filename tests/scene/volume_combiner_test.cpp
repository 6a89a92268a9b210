// The tiled combination against the plain one, and the rules by which work is skipped, bit for bit.

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>
#include <random>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "scene/core/tile_kernels.h"
#include "scene/volume/volume_combiner.h"
#include "tests/scene/test_volumes.h"

namespace daylit {
namespace {

using Storage = VolumeCombiner::Storage;

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

TEST(VolumeCombiner, tiles_give_what_the_plain_combination_gives) {
  for (const glm::ivec3 count : {glm::ivec3(1, 1, 1), glm::ivec3(3, 2, 2), glm::ivec3(5, 7, 6)})
    for (const int rows : {1, 5, 64}) {
      const BasisVolume volume = volume_of(count, rows);
      const auto radiance = test::random_radiance(volume, 3);
      const LightField expected = combine(volume, radiance);
      VolumeCombiner full = VolumeCombiner::make(volume, Storage::float32),
                     fixed = VolumeCombiner::make(volume, Storage::fixed16);
      EXPECT_EQ(full.update(radiance), static_cast<std::size_t>(rows));
      fixed.update(radiance);
      // Sums of `rows` products in another order; fixed point carries 14 bits, errors are independent.
      EXPECT_LT(largest_difference(full.field(), expected), 2e-6 * largest_value(expected) * std::sqrt(rows));
      EXPECT_LT(largest_difference(fixed.field(), expected), 6e-4 * largest_value(expected));
    }
}

TEST(VolumeCombiner, fixed_point_of_a_usual_volume_stays_below_2e_4_of_the_maximum) {
  BasisVolume volume = volume_of({8, 8, 8}, 64);
  for (std::size_t k = 0; k < volume.basis.size(); ++k) // rows of different size, as windows make them
    volume.basis[k] *= std::exp(0.25f * static_cast<float>(k / volume.row_floats() % 12));
  const auto radiance = test::random_radiance(volume, 4);
  VolumeCombiner fixed = VolumeCombiner::make(volume, Storage::fixed16);
  fixed.update(radiance);
  const LightField expected = combine(volume, radiance);
  EXPECT_LT(largest_difference(fixed.field(), expected), 2e-4 * largest_value(expected));
  EXPECT_EQ(fixed.tiles().size(), 3u * 36 * (64 + 2) * 128 * 2); // a pair of rows between the tiles is empty
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

TEST(VolumeCombiner, a_few_probes_have_the_bits_of_the_full_combination) {
  const BasisVolume volume = volume_of({7, 5, 6}, 64);
  const auto radiance = test::random_radiance(volume, 7);
  for (const Storage storage : {Storage::float32, Storage::fixed16}) {
    VolumeCombiner c = VolumeCombiner::make(volume, storage);
    c.update(radiance);
    const std::vector<std::uint32_t> probes{209, 0, 13, 14, 15, 100, 101, 13};
    const std::vector<Sh9Rgb> some = c.combine_at(radiance, probes);
    for (std::size_t i = 0; i < probes.size(); ++i)
      EXPECT_EQ(std::memcmp(&some[i], &c.field().probe[probes[i]], sizeof(Sh9Rgb)), 0) << probes[i];
  }
}

TEST(VolumeCombiner, steps_read_the_changed_rows_only_and_do_not_drift) {
  const BasisVolume volume = volume_of({5, 4, 3}, 64);
  for (const auto& [storage, bound] : {std::pair{Storage::float32, 1e-5}, {Storage::fixed16, 2e-4}}) {
    auto radiance = test::random_radiance(volume, 8);
    VolumeCombiner c = VolumeCombiner::make(volume, storage);
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
    EXPECT_LT(largest_difference(c.field(), expected), bound * largest_value(expected));
  }
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

TEST(TileKernels, every_vector_width_agrees_with_the_scalar_sums) {
  std::mt19937 random(12);
  std::uniform_real_distribution<float> unit(-1.0f, 1.0f);
  constexpr std::size_t kRows = 9;
  std::vector<float> floats(kRows * detail::kTileNumbers);
  for (float& x : floats)
    x = unit(random);
  const std::vector<detail::WeightedRow> rows{{0, 0.5f}, {3, -2.0f}, {8, 1.25f}};
  for (const detail::TileKernels& kernels : detail::usable_tile_kernels())
    for (std::size_t first = 0; first < detail::kTileBlocks; ++first)
      for (std::size_t count = 1; first + count <= detail::kTileBlocks; ++count) {
        std::vector<float> f(detail::kTileNumbers, 1.0f);
        kernels.add_float(floats.data(), rows, first, count, f.data());
        for (std::size_t k = 0; k < detail::kTileNumbers; ++k) {
          const bool inside = k / detail::kBlockNumbers >= first && k / detail::kBlockNumbers < first + count;
          double ef = 1;
          for (const auto& r : rows)
            ef += inside ? double(r.weight) * double(floats[r.row * detail::kTileNumbers + k]) : 0;
          ASSERT_NEAR(double(f[k]), ef, 2e-6) << kernels.name;
        }
      }
}

TEST(TileKernels, fixed_point_sums_are_the_same_integers_in_every_version) {
  std::mt19937 random(15);
  std::normal_distribution<float> normal;
  constexpr std::size_t kPairs = 45;
  std::vector<std::int16_t> tile(kPairs * 2 * detail::kTileNumbers);
  for (std::int16_t& x : tile)
    x = static_cast<std::int16_t>(static_cast<int>(random() % (2 * detail::kFixedMost + 1)) - detail::kFixedMost);
  std::fill_n(tile.begin(), 32 * detail::kTileNumbers, std::int16_t{detail::kFixedMost}); // the largest possible sum
  std::vector<float> scale(2 * kPairs), weight(2 * kPairs);
  for (std::size_t r = 0; r < scale.size(); ++r) {
    scale[r] = r < 32 ? 1.0f : std::exp(normal(random));
    weight[r] = r < 32 ? 1.0f : normal(random);
  }
  std::vector<std::uint32_t> all(kPairs), some;
  std::iota(all.begin(), all.end(), 0u);
  for (std::uint32_t p = 0; p < kPairs; p += 1 + p % 4)
    some.push_back(p);
  constexpr float kTileScale = 0.75f;
  for (const auto& pairs : {all, some, std::vector<std::uint32_t>{3}, std::vector<std::uint32_t>{20, 21, 22}}) {
    const detail::FixedRows rows(weight, scale, pairs);
    for (const auto& [first, count] : {std::pair<std::size_t, std::size_t>{0, 8}, {3, 1}, {1, 6}}) {
      std::vector<float> expected(detail::kTileNumbers, 0.25f);
      detail::usable_tile_kernels().front().add_fixed(tile.data(), kTileScale, rows, first, count, expected.data());
      for (const detail::TileKernels& kernels : detail::usable_tile_kernels()) {
        std::vector<float> sum(detail::kTileNumbers, 0.25f);
        kernels.add_fixed(tile.data(), kTileScale, rows, first, count, sum.data());
        for (std::size_t k = 0; k < detail::kTileNumbers; ++k) {
          double exact = 0.25, size = 0, sizes = 0;
          for (const std::uint32_t p : pairs)
            for (std::size_t j = 0; j < 2; ++j) {
              const double factor = double(kTileScale) * double(weight[2 * p + j]) * double(scale[2 * p + j]),
                           x = factor * tile[(p * 128 + k) * 2 + j];
              exact += x;
              sizes += std::abs(x);
              size = std::max(size, std::abs(factor));
            }
          const bool inside = k / 16 >= first && k / 16 < first + count;
          // One rounding of a float sum between versions; at most half a step of a weight for each number against the
          // truth.
          ASSERT_NEAR(double(sum[k]), double(expected[k]), 4e-7 * sizes + 1e-6) << kernels.name;
          ASSERT_NEAR(double(sum[k]), inside ? exact : 0.25, double(pairs.size()) * size + 1e-3) << kernels.name;
        }
      }
    }
  }
}

TEST(TileKernels, planes_are_interleaved) {
  for (const detail::TileKernels& kernels : detail::usable_tile_kernels())
    for (const std::size_t count : {1u, 15u, 16u, 37u, 64u}) {
      std::vector<float> plane(3 * count), rgb(3 * count);
      for (std::size_t k = 0; k < plane.size(); ++k)
        plane[k] = static_cast<float>(k);
      kernels.interleave(&plane[0], &plane[count], &plane[2 * count], count, rgb.data());
      for (std::size_t k = 0; k < rgb.size(); ++k)
        ASSERT_EQ(rgb[k], plane[k % 3 * count + k / 3]) << kernels.name;
      kernels.add_interleaved(&plane[0], &plane[count], &plane[2 * count], count, rgb.data());
      for (std::size_t k = 0; k < rgb.size(); ++k)
        ASSERT_EQ(rgb[k], 2 * plane[k % 3 * count + k / 3]) << kernels.name;
    }
}

TEST(TileKernels, half_floats_round_to_nearest_even_and_back_exactly) {
  for (std::uint32_t h = 0; h < 0x7c00; ++h) {
    const float x = detail::from_half(static_cast<std::uint16_t>(h));
    ASSERT_EQ(detail::to_half(x), h);
    ASSERT_EQ(detail::to_half(-x), h | 0x8000u);
    if (h + 1 < 0x7c00) { // the middle between neighbours goes to the even one
      const float middle = 0.5f * (x + detail::from_half(static_cast<std::uint16_t>(h + 1)));
      ASSERT_EQ(detail::to_half(middle), h % 2 == 0 ? h : h + 1);
      ASSERT_EQ(detail::to_half(std::nextafter(middle, 1e9f)), h + 1);
    }
  }
  EXPECT_EQ(detail::to_half(65520.0f), 0x7c00);
  EXPECT_EQ(detail::to_half(65519.0f), 0x7bff);
}

} // namespace
} // namespace daylit
