#include "sh/quadrature.h"

#include <gtest/gtest.h>

#include "support.h"

namespace daylit::sh {
namespace {

double sum(const std::vector<double>& v) {
  double s = 0.0;
  for (const double x : v)
    s += x;
  return s;
}

/// Integral of cos^k over -1..1 is 2 / (k + 1) for even k.
void expect_moments(const LatitudeRule& rule, double tolerance) {
  for (int k = 0; k <= std::min(rule.exact_degree, 60); k += 2) {
    double moment = 0.0;
    for (std::size_t i = 0; i < rule.weight.size(); ++i)
      moment += rule.weight[i] * std::pow(rule.cos_theta[i], k);
    EXPECT_NEAR(moment, 2.0 / (k + 1.0), tolerance) << k;
  }
}

TEST(Quadrature, moments_are_exact_for_every_rule) {
  for (const int n : {2, 3, 8, 17, 128}) {
    expect_moments(*gauss_legendre(n), 1e-15 * n + 1e-15);
    expect_moments(*fejer(n), 1e-15 * n + 1e-15);
    expect_moments(*clenshaw_curtis(n), 1e-15 * n + 1e-15);
  }
}

TEST(Quadrature, gauss_legendre_nodes_match_published_values) {
  const auto two = *gauss_legendre(2), five = *gauss_legendre(5);
  EXPECT_NEAR(two.cos_theta[0], 1.0 / std::sqrt(3.0), 2e-16);
  EXPECT_NEAR(five.cos_theta[0], std::sqrt(5.0 + 2.0 * std::sqrt(10.0 / 7.0)) / 3.0, 2e-16);
  EXPECT_NEAR(five.weight[0], (322.0 - 13.0 * std::sqrt(70.0)) / 900.0, 2e-16);
  EXPECT_EQ(five.cos_theta[2], 0.0);
  EXPECT_NEAR(five.weight[2], 128.0 / 225.0, 2e-16);
}

TEST(Quadrature, gauss_legendre_is_good_to_1e_15_at_4096_nodes) {
  const auto rule = *gauss_legendre(4096);
  EXPECT_NEAR(sum(rule.weight), 2.0, 2e-15);
  // The outermost colatitude approaches the first zero of J_0 / (n + 1/2).
  EXPECT_NEAR(rule.theta[0] * 4096.5, 2.404825557695773, 1e-7);
  for (std::size_t i = 1; i < rule.theta.size(); ++i)
    ASSERT_GT(rule.theta[i], rule.theta[i - 1]);
}

TEST(Quadrature, grids_cover_the_sphere_and_mirror_to_the_last_bit) {
  for (const auto& grid : {*gauss_legendre_grid(31), *equirectangular_grid(64, 33), *clenshaw_curtis_grid(20, 40)}) {
    EXPECT_NEAR(sum(grid.weight_sr) * grid.longitudes, 4.0 * std::numbers::pi, 1e-13);
    for (int i = 0; i < grid.rings(); ++i) {
      EXPECT_EQ(grid.cos_theta[std::size_t(i)], -grid.cos_theta[std::size_t(grid.rings() - 1 - i)]);
      EXPECT_GT(grid.weight_sr[std::size_t(i)], 0.0);
    }
  }
}

TEST(Quadrature, centre_of_an_equirectangular_image_looks_along_x) {
  const auto grid = *equirectangular_grid(8, 4);
  const double left = grid.first_azimuth + grid.turn * 2.0 * std::numbers::pi * 3.0 / 8.0;
  const double right = grid.first_azimuth + grid.turn * 2.0 * std::numbers::pi * 4.0 / 8.0;
  EXPECT_NEAR(left, -right, 1e-15); // columns 3 and 4 lie on both sides of the centre
  EXPECT_GT(left, 0.0);             // azimuth grows to the left
}

} // namespace
} // namespace daylit::sh
