#include "sh/algebra.h"

#include <gtest/gtest.h>

#include "sh/band_probe.h"
#include "sh/basis.h"
#include "sh/zonal.h"
#include "support.h"

namespace daylit::sh {
namespace {

using namespace test;

TEST(Algebra, product_equals_the_product_of_values) {
  const auto f = random_numbers(8 * 8, 51), g = random_numbers(5 * 5, 52);
  const auto h = *product(f, g, 11); // 7 + 4: nothing is cut
  std::mt19937_64 engine(53);
  std::vector<double> y(144);
  for (int k = 0; k < 20; ++k) {
    ASSERT_TRUE(evaluate(11, random_direction(engine), y));
    EXPECT_NEAR(inner_product(h, y), inner_product(f, y) * inner_product(g, y), 1e-12);
  }
}

TEST(Algebra, product_cut_at_a_lower_degree_keeps_the_lower_bands) {
  const auto f = random_numbers(8 * 8, 54), g = random_numbers(5 * 5, 55);
  const auto all = *product(f, g, 11), cut = *product(f, g, 3);
  for (std::size_t i = 0; i < cut.size(); ++i)
    EXPECT_NEAR(cut[i], all[i], 1e-13);
}

TEST(Algebra, product_of_two_harmonics_is_a_gaunt_integral) {
  // integral of Y_10 Y_10 Y_20 = 1 / sqrt(5 pi)
  const std::vector<double> f{0, 0, 1, 0};
  EXPECT_NEAR((*product(f, f, 2))[6], 1.0 / std::sqrt(5.0 * std::numbers::pi), 1e-14);
}

TEST(Algebra, inner_product_is_the_integral_of_the_product) {
  const auto f = random_numbers(49, 56), g = random_numbers(49, 57);
  EXPECT_NEAR((*product(f, g, 0))[0] * std::sqrt(4.0 * std::numbers::pi), inner_product(f, g), 1e-12);
}

TEST(Algebra, chosen_degree_is_the_smallest_that_meets_the_tolerance) {
  const std::vector<double> energies{4.0, 1.0, 0.25, 0.0, 0.01}, ones(5, 1.0);
  const double unit = std::sqrt(4.0 * std::numbers::pi);
  EXPECT_EQ(choose_degree(ones, energies, 0.0, 0.0)->degree, 4);
  EXPECT_EQ(choose_degree(ones, energies, 0.0, 0.11 / unit)->degree, 2);
  EXPECT_EQ(choose_degree(ones, energies, 0.0, 0.52 / unit)->degree, 1);
  EXPECT_EQ(choose_degree(ones, energies, 0.0, 9.0)->degree, 0);
  const auto missing = *choose_degree(ones, energies, 1.0, 0.5 / unit);
  EXPECT_EQ(missing.degree, 4);
  EXPECT_NEAR(missing.rms_left * unit, 1.0, 1e-14) << "the energy above the known bands must be reported";
}

TEST(Algebra, adaptive_analysis_stops_at_the_last_band_that_holds_energy) {
  const auto grid = *equirectangular_grid(512, 256);
  auto transform = *RingTransform::create(grid, 20);
  const auto c = random_numbers(coefficient_count(20) * 3, 58);
  std::vector<float> image(grid.samples() * 3);
  ASSERT_TRUE(transform.synthesise(c, interleaved(image.data(), 512, 3)));
  const auto found = *analyse_to_tolerance(grid, interleaved<const float>(image.data(), 512, 3), 1e-5);
  EXPECT_EQ(found.choice.degree, 20);
  EXPECT_LT(max_difference(found.coefficients, c), 1e-5);
  const auto coarse = *analyse_to_tolerance(grid, interleaved<const float>(image.data(), 512, 3), 0.5);
  EXPECT_LT(coarse.choice.degree, 20);
  EXPECT_GT(coarse.choice.rms_left, 0.0);
  EXPECT_GE(coarse.choice.max_left, coarse.choice.rms_left);
}

TEST(Algebra, band_probe_measures_the_error_of_every_cut) {
  constexpr int kDegree = 30;
  auto c = random_numbers(31 * 31, 59);
  c[0] = 40.0; // keeps the map away from zero
  const auto bands = *phong_mean_bands(20.0, kDegree);
  std::mt19937_64 engine(60);
  std::vector<double> x, y, z, basis(31 * 31);
  for (int k = 0; k < 37; ++k) {
    const auto n = random_direction(engine);
    x.push_back(n.x), y.push_back(n.y), z.push_back(n.z);
  }
  const auto probe = *BandProbe::create(c, 1, x, y, z);
  const auto errors = probe.mean_relative_errors(bands, false);
  auto lobe = c;
  ASSERT_TRUE(convolve(bands, 1, lobe));
  for (const std::size_t cut : {0u, 3u, 10u, 29u}) {
    double mean = 0.0;
    for (std::size_t k = 0; k < x.size(); ++k) {
      ASSERT_TRUE(evaluate(kDegree, {x[k], y[k], z[k]}, basis));
      const double full = inner_product(lobe, basis);
      const double part = inner_product(std::span(lobe).first((cut + 1) * (cut + 1)), basis);
      mean += std::abs(part - full) / std::abs(full) / double(x.size());
    }
    EXPECT_NEAR(errors[cut], mean, 1e-12) << cut;
  }
  const int needed = probe.needed_degree(bands, false, 1e-4);
  EXPECT_LT(errors[std::size_t(needed)], 1e-4);
  EXPECT_GE(errors[std::size_t(needed) - 1], 1e-4);
}

TEST(Algebra, band_probe_divides_by_the_last_channel_cut_alike) {
  constexpr int kDegree = 12;
  auto c = random_numbers(13 * 13 * 2, 66);
  c[0] = 9.0, c[1] = 7.0; // means of value and weight
  const std::vector<double> x{0.6}, y{0.0}, z{0.8}, ones(13, 1.0);
  const auto errors = BandProbe::create(c, 2, x, y, z)->mean_relative_errors(ones, true);
  std::vector<double> basis(13 * 13);
  ASSERT_TRUE(evaluate(kDegree, {0.6, 0.0, 0.8}, basis));
  const auto quotient = [&](int cut) {
    double value = 0.0, weight = 0.0;
    for (std::size_t i = 0; i < std::size_t((cut + 1) * (cut + 1)); ++i) {
      value += c[2 * i] * basis[i];
      weight += c[2 * i + 1] * basis[i];
    }
    return value / weight;
  };
  for (const int cut : {0, 1, 5, 11, 12})
    EXPECT_NEAR(errors[std::size_t(cut)], std::abs(quotient(cut) / quotient(kDegree) - 1.0), 1e-12) << cut;
}

} // namespace
} // namespace daylit::sh
