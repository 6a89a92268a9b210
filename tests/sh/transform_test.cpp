#include "sh/transform.h"

#include <gtest/gtest.h>

#include "sh/basis.h"
#include "support.h"

namespace daylit::sh {
namespace {

using namespace test;

double round_trip_error(int degree, int channels) {
  const auto grid = *gauss_legendre_grid(degree);
  auto transform = *RingTransform::create(grid, degree);
  const auto c = random_numbers(coefficient_count(degree) * std::size_t(channels), 7);
  std::vector<double> image(grid.samples() * std::size_t(channels)), back(c.size());
  EXPECT_TRUE(transform.synthesise(c, interleaved(image.data(), grid.longitudes, channels)));
  EXPECT_TRUE(transform.analyse(interleaved<const double>(image.data(), grid.longitudes, channels), back));
  return max_difference(c, back);
}

TEST(RingTransform, round_trip_in_double_is_within_1e_13_up_to_degree_100_for_any_channel_count) {
  for (const int degree : {0, 1, 2, 3, 7, 8, 33, 100})
    for (const int channels : {1, 2, 3, 4, 7})
      EXPECT_LT(round_trip_error(degree, channels), 3e-13) << degree << " " << channels;
}
TEST(RingTransform, round_trip_in_double_is_within_1e_12_at_degree_255) { EXPECT_LT(round_trip_error(255, 3), 1e-12); }
TEST(RingTransform, round_trip_in_double_is_within_1e_11_at_degree_1023) {
  EXPECT_LT(round_trip_error(1023, 1), 1e-11);
}

TEST(RingTransform, round_trip_through_float_images_is_within_1e_6_at_degree_1023) {
  constexpr int kDegree = 1023;
  const auto grid = *gauss_legendre_grid(kDegree);
  auto transform = *RingTransform::create(grid, kDegree);
  auto c = random_numbers(coefficient_count(kDegree), 8);
  std::vector<float> single(c.begin(), c.end()), image(grid.samples());
  c.assign(single.begin(), single.end());
  std::vector<double> back(c.size());
  ASSERT_TRUE(transform.synthesise(c, interleaved(image.data(), grid.longitudes, 1)));
  ASSERT_TRUE(transform.analyse(interleaved<const float>(image.data(), grid.longitudes, 1), back));
  double worst = 0.0;
  for (std::size_t i = 0; i < c.size(); ++i)
    worst = std::max(worst, std::abs(double(float(back[i])) - c[i]));
  EXPECT_LT(worst, 1e-6);
}

/// Every kind of grid and ring length against evaluate() at its samples.
void expect_synthesis_equals_evaluation(const RingGrid& grid, int degree) {
  auto transform = *RingTransform::create(grid, degree);
  const auto c = random_numbers(coefficient_count(degree), 9);
  std::vector<double> image(grid.samples()), basis(c.size());
  ASSERT_TRUE(transform.synthesise(c, interleaved(image.data(), grid.longitudes, 1)));
  for (int i = 0; i < grid.rings(); ++i)
    for (int j = 0; j < grid.longitudes; j += 1 + grid.longitudes / 5) {
      const double phi = grid.first_azimuth + grid.turn * 2.0 * std::numbers::pi * j / grid.longitudes;
      const double s = grid.sin_theta[std::size_t(i)];
      ASSERT_TRUE(evaluate(degree, {s * std::cos(phi), s * std::sin(phi), grid.cos_theta[std::size_t(i)]}, basis));
      double sum = 0.0;
      for (std::size_t k = 0; k < c.size(); ++k)
        sum += c[k] * basis[k];
      ASSERT_NEAR(image[std::size_t(i) * std::size_t(grid.longitudes) + std::size_t(j)], sum, 1e-12 * (degree + 1))
          << "ring " << i << " column " << j << " of " << grid.longitudes;
    }
}

TEST(RingTransform, synthesis_equals_evaluation_for_even_odd_prime_and_too_short_rings) {
  for (const int longitudes : {1, 2, 3, 7, 16, 17, 24, 30, 49, 50, 62, 64, 97, 206})
    expect_synthesis_equals_evaluation(*gauss_legendre_grid(20, longitudes), 20);
}
TEST(RingTransform, synthesis_equals_evaluation_on_image_grids) {
  expect_synthesis_equals_evaluation(*equirectangular_grid(64, 32), 30);
  expect_synthesis_equals_evaluation(*equirectangular_grid(33, 17), 30);
  expect_synthesis_equals_evaluation(*clenshaw_curtis_grid(21, 40), 30);
  expect_synthesis_equals_evaluation(*clenshaw_curtis_grid(2, 5), 3);
}

TEST(RingTransform, analysis_inverts_synthesis_on_equirectangular_and_clenshaw_curtis_grids) {
  for (const auto& grid : {*equirectangular_grid(128, 64), *clenshaw_curtis_grid(65, 70)}) {
    constexpr int kDegree = 31;
    ASSERT_GE(grid.exact_degree, 2 * kDegree);
    auto transform = *RingTransform::create(grid, kDegree);
    const auto c = random_numbers(coefficient_count(kDegree) * 3, 10);
    std::vector<double> image(grid.samples() * 3), back(c.size());
    ASSERT_TRUE(transform.synthesise(c, interleaved(image.data(), grid.longitudes, 3)));
    ASSERT_TRUE(transform.analyse(interleaved<const double>(image.data(), grid.longitudes, 3), back));
    EXPECT_LT(max_difference(c, back), 1e-13);
  }
}

/// <A x, y> = <x, A^T y>, relative to the norms.
double adjointness_defect(const RingGrid& grid, int degree) {
  auto transform = *RingTransform::create(grid, degree);
  const auto x = random_numbers(coefficient_count(degree), 11), y = random_numbers(grid.samples(), 12);
  std::vector<double> ax(y.size()), aty(x.size());
  EXPECT_TRUE(transform.synthesise(x, interleaved(ax.data(), grid.longitudes, 1)));
  EXPECT_TRUE(transform.adjoint_synthesise(interleaved(y.data(), grid.longitudes, 1), aty));
  double left = 0.0, right = 0.0, ax2 = 0.0, y2 = 0.0;
  for (std::size_t i = 0; i < y.size(); ++i) {
    left += ax[i] * y[i];
    ax2 += ax[i] * ax[i];
    y2 += y[i] * y[i];
  }
  for (std::size_t i = 0; i < x.size(); ++i)
    right += x[i] * aty[i];
  return std::abs(left - right) / std::sqrt(ax2 * y2);
}
TEST(RingTransform, adjoint_defect_is_below_1e_12_at_degree_100) {
  EXPECT_LT(adjointness_defect(*gauss_legendre_grid(100), 100), 1e-12);
  EXPECT_LT(adjointness_defect(*equirectangular_grid(100, 50), 100), 1e-12);
  EXPECT_LT(adjointness_defect(*equirectangular_grid(35, 50), 100), 1e-12);
}
TEST(RingTransform, adjoint_defect_is_below_1e_10_at_degree_1000) {
  EXPECT_LT(adjointness_defect(*gauss_legendre_grid(1000), 1000), 1e-10);
}

/// Analysis of Y_lm itself gives a unit vector.
void expect_orthonormal(int degree, std::initializer_list<std::size_t> indices, double tolerance) {
  const auto grid = *gauss_legendre_grid(degree);
  auto transform = *RingTransform::create(grid, degree);
  std::vector<double> image(grid.samples()), c(coefficient_count(degree));
  for (const std::size_t index : indices) {
    std::fill(c.begin(), c.end(), 0.0);
    c[index] = 1.0;
    ASSERT_TRUE(transform.synthesise(c, interleaved(image.data(), grid.longitudes, 1)));
    ASSERT_TRUE(transform.analyse(interleaved<const double>(image.data(), grid.longitudes, 1), c));
    c[index] -= 1.0;
    for (const double v : c)
      ASSERT_NEAR(v, 0.0, tolerance) << index;
  }
}
TEST(RingTransform, harmonics_are_orthonormal_by_quadrature_to_1e_12_at_degree_100) {
  expect_orthonormal(100, {0, 1, 2, 3, 50 * 50, 50 * 50 + 50, 10000, 10100, 10200, 10150}, 1e-12);
}
TEST(RingTransform, harmonics_are_orthonormal_by_quadrature_to_1e_10_at_degree_1000) {
  expect_orthonormal(1000, {1000000, 1001000, 1002000, 1001500}, 1e-10);
}

TEST(RingTransform, planar_and_padded_images_give_the_same_numbers_as_interleaved_ones) {
  const auto grid = *gauss_legendre_grid(20);
  auto transform = *RingTransform::create(grid, 20);
  const auto c = random_numbers(coefficient_count(20) * 3, 13);
  const std::ptrdiff_t width = grid.longitudes, plane = width * grid.rings();
  std::vector<double> packed(grid.samples() * 3), planes(grid.samples() * 3), back(c.size()), same(c.size());
  const ImageView<double> planar{planes.data(), width, 1, plane, 3};
  ASSERT_TRUE(transform.synthesise(c, interleaved(packed.data(), grid.longitudes, 3)));
  ASSERT_TRUE(transform.synthesise(c, planar));
  for (std::size_t i = 0; i < grid.samples(); ++i)
    for (std::size_t k = 0; k < 3; ++k)
      ASSERT_EQ(packed[3 * i + k], planes[k * std::size_t(plane) + i]);
  ASSERT_TRUE(transform.analyse(interleaved<const double>(packed.data(), grid.longitudes, 3), back));
  ASSERT_TRUE(transform.analyse(ImageView<const double>{planes.data(), width, 1, plane, 3}, same));
  EXPECT_EQ(back, same);
}

} // namespace
} // namespace daylit::sh
