// Ranges at which published implementations return NaN, zero or noise.

#include <gtest/gtest.h>

#include "sh/basis.h"
#include "sh/direction_transform.h"
#include "sh/transform.h"
#include "support.h"

namespace daylit::sh {
namespace {

using namespace test;

TEST(Extremes, directions_at_and_within_1e_12_of_the_poles_agree_with_the_limit) {
  constexpr int kDegree = 1000;
  std::vector<double> y(1001 * 1001);
  for (const double r : {0.0, 1e-320, 1e-300, 1e-160, 1e-20, 1e-12})
    for (const double z : {1.0, -1.0}) {
      ASSERT_TRUE(evaluate(kDegree, {r, -r, z}, y));
      for (int l = 0; l <= kDegree; ++l) {
        const double top = row_maximum(l), parity = z < 0.0 && l % 2 ? -1.0 : 1.0;
        ASSERT_NEAR(y[std::size_t(l * l + l)], parity * top, 1e-12 * top) << r;
        for (int m = 1; m <= l; ++m) {
          // |P_lm| <= (l theta)^m / (2^m m!) x row maximum near the pole; the first order dominates.
          const double limit = top * double(l) * 1.5 * r + 1e-12 * top;
          ASSERT_LE(std::abs(y[std::size_t(l * l + l + m)]), limit) << r << " " << l << " " << m;
          ASSERT_LE(std::abs(y[std::size_t(l * l + l - m)]), limit);
        }
      }
    }
}

/// Round trip of coefficients scaled to `size`, relative to it.
double scaled_round_trip(double size) {
  constexpr int kDegree = 60;
  const auto grid = *gauss_legendre_grid(kDegree);
  auto transform = *RingTransform::create(grid, kDegree);
  auto c = random_numbers(coefficient_count(kDegree) * 3, 71);
  for (double& v : c)
    v *= size;
  std::vector<double> image(grid.samples() * 3), back(c.size());
  EXPECT_TRUE(transform.synthesise(c, interleaved(image.data(), grid.longitudes, 3)));
  EXPECT_TRUE(transform.analyse(interleaved<const double>(image.data(), grid.longitudes, 3), back));
  return max_difference(c, back) / size;
}
TEST(Extremes, inputs_from_1e_minus_300_to_1e_300_keep_the_relative_error) {
  // 3e-307 and 1e305: without scaling the weighted samples would be denormal, the sums over a ring infinite.
  for (const double size : {3e-307, 1e-300, 1e-200, 1e-100, 1.0, 1e100, 1e200, 1e300, 1e305})
    EXPECT_LT(scaled_round_trip(size), 1e-12) << size;
}
TEST(Extremes, denormal_inputs_come_back_to_their_own_resolution) {
  const double smallest = 4.9406564584124654e-324;
  EXPECT_LT(scaled_round_trip(1e-310) * 1e-310, 100.0 * smallest);
}

TEST(Extremes, one_pixel_of_1e9_in_a_field_of_one_is_analysed_exactly) {
  constexpr int kDegree = 100;
  const auto grid = *equirectangular_grid(512, 256);
  auto transform = *RingTransform::create(grid, kDegree);
  std::vector<float> image(grid.samples(), 1.0f);
  const std::size_t row = 77, column = 200;
  image[row * 512 + column] = 1e9f;
  std::vector<double> c(coefficient_count(kDegree)), y(c.size());
  ASSERT_TRUE(transform.analyse(interleaved<const float>(image.data(), 512, 1), c));
  const double phi = grid.first_azimuth + grid.turn * 2.0 * std::numbers::pi * double(column) / 512.0;
  const double s = grid.sin_theta[row];
  ASSERT_TRUE(evaluate(kDegree, {s * std::cos(phi), s * std::sin(phi), grid.cos_theta[row]}, y));
  const double power = (1e9 - 1.0) * grid.weight_sr[row];
  for (std::size_t i = 0; i < c.size(); ++i) {
    const double expected = power * y[i] + (i == 0 ? std::sqrt(4.0 * std::numbers::pi) : 0.0);
    ASSERT_NEAR(c[i], expected, 1e-13 * power * row_maximum(kDegree)) << i;
  }
}

TEST(Extremes, transforms_of_zero_are_zero) {
  const auto grid = *gauss_legendre_grid(9);
  auto transform = *RingTransform::create(grid, 9);
  std::vector<double> image(grid.samples(), 0.0), c(coefficient_count(9), 1.0);
  ASSERT_TRUE(transform.analyse(interleaved<const double>(image.data(), grid.longitudes, 1), c));
  for (const double v : c)
    EXPECT_EQ(v, 0.0);
}

} // namespace
} // namespace daylit::sh
