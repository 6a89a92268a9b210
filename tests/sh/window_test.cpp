#include "sh/window.h"

#include <gtest/gtest.h>

#include "sh/basis.h"
#include "sh/zonal.h"
#include "support.h"

namespace daylit::sh {
namespace {

using namespace test;

/// Irradiance of one directional light from +z, cut after `degree`.
std::vector<double> point_light_irradiance(int degree) {
  std::vector<double> c(std::size_t(degree + 1) * std::size_t(degree + 1), 0.0);
  for (int l = 0; l <= degree; ++l)
    c[std::size_t(l * l + l)] = row_maximum(l);
  EXPECT_TRUE(convolve(*clamped_cosine_bands(degree), 1, c));
  return c;
}

// 1/4 + t/2 + 5 (3 t^2 - 1) / 32: minimum at t = -8/15.
TEST(Window, nine_coefficients_of_a_point_light_ring_to_minus_0_039583) {
  const auto low = *minimum_on_sphere(point_light_irradiance(2));
  EXPECT_NEAR(low.value, -0.0395833333333333, 1e-14);
  EXPECT_NEAR(low.direction[2], -8.0 / 15.0, 1e-7);
}

TEST(Window, exact_minimum_of_nine_coefficients_is_below_every_sample_and_attained) {
  std::mt19937_64 engine(31);
  for (int k = 0; k < 50; ++k) {
    auto c = random_numbers(9, 100 + std::uint64_t(k));
    if (k % 5 == 0) // no band 1: the free-direction case of the secular equation
      c[1] = c[2] = c[3] = 0.0;
    if (k % 7 == 0)
      c[4] = c[5] = c[6] = c[7] = c[8] = 0.0;
    const auto low = *minimum_on_sphere(c);
    const glm::dvec3 at(low.direction[0], low.direction[1], low.direction[2]);
    ASSERT_NEAR(glm::length(at), 1.0, 1e-7);
    const auto value = [&](const glm::dvec3& n) {
      const auto y = evaluate9<double>(n);
      double sum = 0.0;
      for (std::size_t i = 0; i < 9; ++i)
        sum += c[i] * y[i];
      return sum;
    };
    EXPECT_NEAR(value(at), low.value, 1e-9) << k;
    for (int i = 0; i < 2000; ++i)
      ASSERT_GE(value(random_direction(engine)), low.value - 1e-12) << k;
  }
}

TEST(Window, smallest_nonnegative_window_touches_zero_and_says_its_price) {
  for (const int degree : {2, 3, 6}) {
    std::vector<double> c(std::size_t(degree + 1) * std::size_t(degree + 1), 0.0);
    for (int l = 0; l <= degree; ++l)
      c[std::size_t(l * l + l)] = row_maximum(l); // a delta from +z: rings hard
    const auto w = *nonnegative_window(c);
    EXPECT_LT(w.minimum_before, 0.0);
    EXPECT_GE(w.minimum_after, -1e-12);
    EXPECT_LT(w.minimum_after, 1e-6) << "a smaller window would have done";
    EXPECT_EQ(w.bands[0], 1.0);
    EXPECT_GT(w.strength, 0.0);
    EXPECT_LT(w.bias.energy_kept, 1.0);
    EXPECT_GE(w.bias.max_change, w.bias.rms_change);
  }
}

TEST(Window, a_function_that_does_not_ring_is_left_alone) {
  const std::vector<double> c{1.0, 0.1, 0.1, 0.1};
  const auto w = *nonnegative_window(c);
  EXPECT_EQ(w.strength, 0.0);
  EXPECT_EQ(w.bands[1], 1.0);
  EXPECT_EQ(w.bias.max_change, 0.0);
}

TEST(Window, hann_and_lanczos_fall_from_one_to_zero_at_the_cutoff) {
  for (const auto& w : {*hann_window(10, 8.0), *lanczos_window(10, 8.0)}) {
    EXPECT_EQ(w[0], 1.0);
    for (std::size_t l = 1; l < w.size(); ++l)
      EXPECT_LE(w[l], w[l - 1]);
    EXPECT_EQ(w[8], 0.0);
  }
  EXPECT_NEAR((*hann_window(10, 8.0))[4], 0.5, 1e-15);
  EXPECT_NEAR((*lanczos_window(10, 8.0))[4], 2.0 / std::numbers::pi, 1e-15);
}

TEST(Window, stated_bias_bounds_the_change_and_is_exact_in_the_mean_square) {
  constexpr int kDegree = 6;
  const auto c = random_numbers(49, 32);
  const auto w = *hann_window(kDegree, 7.0);
  const auto bias = *window_bias(w, c);
  std::mt19937_64 engine(33);
  std::vector<double> y(49);
  double square = 0.0, worst = 0.0;
  constexpr int kSamples = 20000;
  for (int k = 0; k < kSamples; ++k) {
    ASSERT_TRUE(evaluate(kDegree, random_direction(engine), y));
    double change = 0.0;
    for (std::size_t l = 0; l <= kDegree; ++l)
      for (std::size_t i = l * l; i < (l + 1) * (l + 1); ++i)
        change += (w[l] - 1.0) * c[i] * y[i];
    square += change * change / kSamples;
    worst = std::max(worst, std::abs(change));
  }
  EXPECT_LE(worst, bias.max_change);
  EXPECT_NEAR(std::sqrt(square), bias.rms_change, 0.05 * bias.rms_change); // 20,000 samples: 1 % expected
}

} // namespace
} // namespace daylit::sh
