// Bytes times weights of 16 bits: every version against sums in 64 bits, up to the largest that can occur.

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include <gtest/gtest.h>

#include "scene/core/tile_kernels.h"
#include "scene/volume/plane_kernels.h"

namespace daylit::detail {
namespace {

std::int64_t weight_of(std::int32_t high, std::int32_t low, std::size_t k) {
  const auto byte = [k](std::int32_t word) {
    return static_cast<std::int8_t>(static_cast<std::uint32_t>(word) >> 8 * k);
  };
  return 256 * byte(high) + byte(low);
}

std::vector<std::int8_t> random_bytes(std::size_t count, bool largest) {
  std::mt19937 random(14);
  std::vector<std::int8_t> bytes(count);
  for (std::int8_t& b : bytes)
    b = static_cast<std::int8_t>(largest ? -128 : static_cast<int>(random() % 256) - 128);
  return bytes;
}

TEST(PlaneKernels, weights_keep_16_bits_of_the_largest) {
  const std::vector<float> weight{0.5f, -2.0f, 1.99f, 1e-5f, 0.0f, -0.0123f};
  const RoundedWeights rounded(weight);
  ASSERT_EQ(rounded.quad.size(), 2u);
  for (std::size_t k = 0; k < 8; ++k) {
    const QuadWeights& q = rounded.quad[k / 4];
    const double value = double(rounded.step) * double(weight_of(q.high, q.low, k % 4));
    EXPECT_NEAR(value, k < weight.size() ? double(weight[k]) : 0.0, 0.501 * double(rounded.step));
  }
  EXPECT_EQ(RoundedWeights(std::vector<float>(5, 0.0f)).step, 0.0f);
}

TEST(PlaneKernels, colours_are_rounded_apart_and_transposed_by_fours) {
  std::mt19937 random(15);
  std::normal_distribution<float> normal;
  std::vector<Rgb> weight(37);
  for (Rgb& w : weight)
    w = {normal(random), 100.0f * normal(random), 0.0f};
  weight[5] = Rgb(0.0f);
  const RoundedColours rounded(weight);
  EXPECT_EQ(rounded.step[2], 0.0f);
  std::vector<std::uint32_t> list{36, 0, 17, 17};
  list.insert(list.end(), 4, 5); // a quad in the dark
  list.insert(list.end(), {1, 2});
  const LitQuads lit = rounded.lit_quads(list);
  ASSERT_EQ(lit.quad, (std::vector<std::uint32_t>{0, 2}));
  for (std::size_t q = 0; q < 2; ++q)
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t i = 0; i < (q == 0 ? 4u : 2u); ++i) {
        const QuadWeights& w = lit.weight[q].colour[c];
        EXPECT_NEAR(double(rounded.step[c]) * double(weight_of(w.high, w.low, i)),
                    double(weight[list[lit.quad[q] * 4 + i]][int(c)]), 0.501 * double(rounded.step[c]));
      }
}

TEST(PlaneKernels, consecutive_colours_are_rounded_in_steps_of_the_largest_in_every_version) {
  std::mt19937 random(17);
  std::normal_distribution<float> normal;
  for (const std::size_t count : {1u, 4u, 15u, 16u, 17u, 73u, 128u}) {
    std::vector<Rgb> colour(count);
    for (Rgb& c : colour)
      c = {normal(random), 100.0f * normal(random), 1e-4f * normal(random)};
    colour[count / 2].b = -1000.0f;
    const std::size_t quads = (count + 15) / 16 * 4;
    std::vector<ColourWeights> plain(quads);
    const float step = round_quads_baseline(colour, plain.data());
    EXPECT_FLOAT_EQ(step, 1000.0f / float(kWeightMost));
    for (const PlaneKernels& kernels : usable_plane_kernels()) {
      std::vector<ColourWeights> quad(quads, ColourWeights{{{1, 1}, {1, 1}, {1, 1}}, {}});
      EXPECT_EQ(kernels.round_quads(colour, quad.data()), step) << kernels.name;
      for (std::size_t k = 0; k < 4 * quads; ++k)
        for (std::size_t c = 0; c < 3; ++c) {
          const QuadWeights& w = quad[k / 4].colour[c];
          ASSERT_EQ(weight_of(w.high, w.low, k % 4),
                    weight_of(plain[k / 4].colour[c].high, plain[k / 4].colour[c].low, k % 4))
              << kernels.name << " " << k;
          ASSERT_NEAR(double(step) * double(weight_of(w.high, w.low, k % 4)),
                      k < count ? double(colour[k][int(c)]) : 0.0, 0.501 * double(step));
        }
      EXPECT_EQ(kernels.round_quads(std::vector<Rgb>(count, Rgb(0.0f)), quad.data()), 0.0f);
    }
  }
}

TEST(PlaneKernels, sources_are_summed_exactly_in_every_version) {
  std::mt19937 random(16);
  for (const std::size_t planes : {4u, 16u, 28u, 40u, 64u, 116u})
    for (const std::size_t quads : {1u, 5u, 300u, 2000u}) {
      const bool largest = quads == 2000;
      const std::vector<std::int8_t> factor = random_bytes((2 * quads - 1) * planes * kQuad, largest);
      std::vector<Rgb> light(4 * quads, Rgb(1.0f));
      for (int k = 0; k < 12 * int(quads) && !largest; ++k)
        light[std::size_t(k / 3)][k % 3] = static_cast<float>(random() % 2000) - 1000.0f;
      const RoundedColours rounded(light);
      std::vector<std::uint32_t> list(4 * quads);
      std::iota(list.begin(), list.end(), 0u);
      std::vector<ColourWeights> weight = rounded.lit_quads(list).weight;
      ASSERT_EQ(weight.size(), quads);
      std::vector<std::uint32_t> quad(quads);
      for (std::uint32_t k = 0; k < quads; ++k)
        quad[k] = 2 * k; // every other one
      for (const PlaneKernels& kernels : usable_plane_kernels()) {
        std::vector<float> sum(3 * planes, 5.0f);
        kernels.sum_planes(factor.data(), planes, quad, weight.data(), sum.data());
        for (std::size_t c = 0; c < 3; ++c)
          for (std::size_t plane = 0; plane < planes; ++plane) {
            std::int64_t exact = 5;
            for (std::size_t k = 0; k < quads; ++k)
              for (std::size_t i = 0; i < kQuad; ++i)
                exact += weight_of(weight[k].colour[c].high, weight[k].colour[c].low, i) *
                         factor[(quad[k] * planes + plane) * kQuad + i];
            ASSERT_NEAR(double(sum[c * planes + plane]), double(exact), 3e-7 * std::abs(double(exact)) + 100)
                << kernels.name << " " << planes << " " << quads;
          }
      }
    }
}

TEST(PlaneKernels, numbers_of_a_tile_are_summed_exactly_in_every_version) {
  std::mt19937 random(17);
  std::normal_distribution<float> normal;
  for (const std::size_t planes : {1u, 4u, 77u, 3000u}) {
    const bool largest = planes == 3000;
    std::vector<float> weight(planes);
    for (float& w : weight)
      w = largest ? -1.0f : normal(random);
    const RoundedWeights rounded(weight);
    for (const std::size_t numbers : {16u, 80u, 112u, 128u}) {
      const std::vector<std::int8_t> tile = random_bytes(rounded.quad.size() * numbers * kQuad, largest);
      for (const PlaneKernels& kernels : usable_plane_kernels()) {
        std::vector<float> sum(numbers, -3.0f);
        kernels.sum_numbers(tile.data(), numbers, rounded.quad, sum.data());
        for (std::size_t n = 0; n < numbers; ++n) {
          std::int64_t exact = -3;
          for (std::size_t q = 0; q < rounded.quad.size(); ++q)
            for (std::size_t i = 0; i < kQuad; ++i)
              exact += weight_of(rounded.quad[q].high, rounded.quad[q].low, i) * tile[(q * numbers + n) * kQuad + i];
          ASSERT_NEAR(double(sum[n]), double(exact), 3e-7 * std::abs(double(exact)) + 10)
              << kernels.name << " " << planes;
        }
      }
    }
  }
}

} // namespace
} // namespace daylit::detail
