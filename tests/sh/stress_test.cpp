// The long part of the numerical stress suite: every (l, m, theta) to degree 10,000, and the largest transforms.

#include <limits>

#include <gtest/gtest.h>

#include "sh/basis.h"
#include "sh/transform.h"
#include "support.h"

namespace daylit::sh {
namespace {

using namespace test;

/// Largest |error| / row maximum over all degrees of the given orders; infinity when a number is not finite.
double worst_error(double sine, double sign, int order_step) {
  constexpr int kDegree = 10000;
  const long double s = sine, cosine = std::sqrt((1.0L - s) * (1.0L + s));
  std::vector<double> c(kDegree + 1), zero(kDegree + 1);
  double worst = 0.0;
  for (int m = 0; m <= kDegree; m += m < 50 ? 1 : order_step) {
    const std::size_t count = std::size_t(kDegree - m + 1);
    if (!evaluate_order(m, kDegree, {sine, 0.0, sign * double(cosine)}, std::span(c).first(count),
                        std::span(zero).first(count)))
      return std::numeric_limits<double>::infinity();
    const auto p = legendre_reference(m, kDegree, cosine, s);
    for (std::size_t i = 0; i < count; ++i) {
      const double expected = double(p[i]) * (m ? std::numbers::sqrt2 : 1.0) * (sign < 0.0 && i % 2 ? -1.0 : 1.0);
      const double error = std::abs(c[i] - expected) / row_maximum(m + int(i));
      worst = std::isfinite(c[i]) ? std::max(worst, error) : std::numeric_limits<double>::infinity();
    }
  }
  return worst;
}

TEST(Stress, every_order_and_degree_to_10000_is_finite_and_correct_at_every_kind_of_latitude) {
  for (const double sine :
       {0.0, 1e-300, 1e-12, 1e-6, 1e-4, 3e-4, 1e-3, 0.01, 0.1, 0.3, 0.5, 0.7, 0.9, 0.99, 0.9999, 1.0})
    EXPECT_LT(worst_error(sine, 1.0, 97), 1e-11) << "sin theta = " << sine;
  for (const double sine : {1e-4, 0.3, 0.99})
    EXPECT_LT(worst_error(sine, -1.0, 397), 1e-11) << "south, sin theta = " << sine;
}

TEST(Stress, every_single_order_to_10000_at_one_latitude) { EXPECT_LT(worst_error(0.6, 1.0, 1), 1e-11); }

TEST(Stress, round_trip_at_degree_4095_is_within_1e_10) {
  constexpr int kDegree = 4095;
  const auto grid = *gauss_legendre_grid(kDegree);
  auto transform = *RingTransform::create(grid, kDegree);
  const auto c = random_numbers(coefficient_count(kDegree), 91);
  std::vector<double> image(grid.samples()), back(c.size());
  ASSERT_TRUE(transform.synthesise(c, interleaved(image.data(), grid.longitudes, 1)));
  ASSERT_TRUE(transform.analyse(interleaved<const double>(image.data(), grid.longitudes, 1), back));
  EXPECT_LT(max_difference(c, back), 1e-10);
}

} // namespace
} // namespace daylit::sh
