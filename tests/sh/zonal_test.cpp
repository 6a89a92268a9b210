#include "sh/zonal.h"

#include <gtest/gtest.h>

#include "sh/quadrature.h"
#include "support.h"

namespace daylit::sh {
namespace {

TEST(Zonal, clamped_cosine_has_the_published_factors) {
  const auto a = *clamped_cosine_bands(6);
  constexpr double pi = std::numbers::pi;
  const double expected[] = {pi, 2 * pi / 3, pi / 4, 0, -pi / 24, 0, pi / 64};
  for (std::size_t l = 0; l < 7; ++l)
    EXPECT_NEAR(a[l], expected[l], 1e-15) << l;
}

/// 2 pi integral_0^1 t^s P_l(t) dt by Gauss-Legendre on 0..1 in long double.
long double by_quadrature(double s, int l) {
  const int count = 400 + l;
  const auto rule = *gauss_legendre(count);
  long double sum = 0;
  for (std::size_t i = 0; i < rule.weight.size(); ++i) {
    const long double t = 0.5L * (1 + static_cast<long double>(rule.cos_theta[i]));
    long double before = 0, now = 1;
    for (int k = 0; k < l; ++k) {
      const long double next = ((2.0L * k + 1) * t * now - k * before) / (k + 1);
      before = now;
      now = next;
    }
    sum += 0.5L * static_cast<long double>(rule.weight[i]) * std::pow(t, static_cast<long double>(s)) * now;
  }
  return 2 * std::numbers::pi_v<long double> * sum;
}

TEST(Zonal, phong_factors_of_real_exponents_equal_the_integral) {
  for (const double s : {2.0, 7.0, 33.0, 80.5, 320.25})
    for (const int l : {0, 1, 2, 5, 10, 31, 60})
      EXPECT_NEAR((*phong_bands(s, 60))[std::size_t(l)], double(by_quadrature(s, l)), 2e-14) << s << " " << l;
}

// The product formula in long double, multiplied out in another order.
TEST(Zonal, phong_factors_keep_their_relative_accuracy_at_large_exponents_and_degrees) {
  for (const double s : {1.5, 100.7, 1280.0, 20480.0, 1e6 + 0.3}) {
    const auto a = *phong_mean_bands(s, 2000);
    for (const int l : {50, 201, 1000, 1999, 2000}) {
      long double numerator = 0, denominator = 0, sign = 1; // logarithms: the product itself may leave the range
      for (int i = l; i >= 2; i -= 2) {
        const long double f = static_cast<long double>(s) + 2 - i;
        sign = f < 0 ? -sign : sign;
        numerator += std::log(std::abs(f));
        denominator += std::log(static_cast<long double>(s) + i + 1);
      }
      const long double start = l % 2 ? (static_cast<long double>(s) + 1) / (static_cast<long double>(s) + 2) : 1;
      const double expected = double(sign * start * std::exp(numerator - denominator));
      EXPECT_NEAR(a[std::size_t(l)], expected, 1e-12 * std::abs(expected) + 1e-300) << s << " " << l;
    }
  }
}

TEST(Zonal, needed_degree_follows_the_square_root_law) {
  for (const double s : {80.0, 320.0, 1280.0, 5120.0, 20480.0}) {
    const double law = std::sqrt(2.0 * s * std::log(1e5));
    EXPECT_NEAR(*phong_degree(s, 1e-5), law, 0.06 * law) << s;
  }
}

// A point light of unit irradiance straight above: L_lm = Y_lm(z). Its convolution is the kernel itself.
TEST(Zonal, convolution_of_a_point_light_reproduces_the_lobe) {
  constexpr int kDegree = 60;
  constexpr double s = 40.0;
  std::vector<double> c(61 * 61, 0.0);
  for (std::size_t l = 0; l <= kDegree; ++l)
    c[l * l + l] = test::row_maximum(int(l));
  ASSERT_TRUE(convolve(*phong_bands(s, kDegree), 1, c));
  for (const double t : {1.0, 0.95, 0.8, 0.3, -0.5}) {
    const auto p = test::legendre_reference(0, kDegree, t, std::sqrt((1.0L - t) * (1.0L + t)));
    long double value = 0;
    for (std::size_t l = 0; l <= kDegree; ++l)
      value += c[l * l + l] * p[l];
    EXPECT_NEAR(double(value), t > 0 ? std::pow(t, s) : 0.0, 1e-12) << t;
  }
}

} // namespace
} // namespace daylit::sh
