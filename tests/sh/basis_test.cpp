#include "sh/basis.h"

#include <gtest/gtest.h>

#include "sh/band4.h"
#include "sh/zonal.h"
#include "support.h"

namespace daylit::sh {
namespace {

using namespace test;

TEST(Basis, signs_and_order_follow_the_convention_without_condon_shortley) {
  std::vector<double> y(9);
  const glm::dvec3 n = glm::normalize(glm::dvec3(0.3, -0.5, 0.7));
  ASSERT_TRUE(evaluate(2, n, y));
  const double c = std::sqrt(3.0 / (4.0 * std::numbers::pi));
  EXPECT_NEAR(y[1], c * n.y, 1e-15);
  EXPECT_NEAR(y[2], c * n.z, 1e-15);
  EXPECT_NEAR(y[3], c * n.x, 1e-15);
}

TEST(Basis, closed_forms_of_orders_one_to_four_equal_the_recurrence) {
  std::mt19937_64 engine(1);
  for (int k = 0; k < 100; ++k) {
    const glm::dvec3 n = random_direction(engine);
    std::vector<double> y(16);
    ASSERT_TRUE(evaluate(3, n, y));
    const auto closed = evaluate16<double>(n.x, n.y, n.z);
    for (std::size_t i = 0; i < 16; ++i)
      EXPECT_NEAR(closed[i], y[i], 2e-15) << i;
    EXPECT_EQ((evaluate_closed<2, double>(n.x, n.y, n.z)[3]), closed[3]);
    EXPECT_EQ((evaluate_closed<4, double>(n.x, n.y, n.z)[15]), closed[15]);
  }
}

TEST(Basis, closed_form_of_band_four_equals_the_recurrence) {
  std::mt19937_64 engine(1);
  std::vector<double> y(25);
  for (int k = 0; k < 100; ++k) {
    const glm::dvec3 n = random_direction(engine);
    ASSERT_TRUE(evaluate(4, n, y));
    const auto closed = evaluate_band4<double>(n);
    for (std::size_t i = 0; i < 9; ++i)
      EXPECT_NEAR(closed[i], y[16 + i], 4e-15) << i;
  }
}

TEST(Basis, irradiance_skips_band_three_so_that_band_four_is_its_next_order) {
  const auto a = clamped_cosine_bands(4);
  ASSERT_TRUE(a);
  EXPECT_NEAR((*a)[3], 0.0, 1e-15);
  EXPECT_NEAR((*a)[4], kClampedCosineBand4<double>, 1e-15);
}

/// Sum over m of Y_lm^2 = (2l + 1) / 4 pi.
void expect_addition_theorem(int degree, double tolerance) {
  std::mt19937_64 engine(2);
  std::vector<double> y(std::size_t(degree + 1) * std::size_t(degree + 1));
  for (int k = 0; k < 4; ++k) {
    const glm::dvec3 n = k == 3 ? glm::normalize(glm::dvec3(1e-4, 1e-5, -1)) : random_direction(engine);
    ASSERT_TRUE(evaluate(degree, n, y));
    for (int l = 0; l <= degree; ++l) {
      double sum = 0.0;
      for (int m = -l; m <= l; ++m)
        sum += y[std::size_t(l * l + l + m)] * y[std::size_t(l * l + l + m)];
      ASSERT_NEAR(sum * 4.0 * std::numbers::pi / (2.0 * l + 1.0), 1.0, tolerance) << l;
    }
  }
}
TEST(Basis, addition_theorem_holds_to_1e_12_at_degree_100) { expect_addition_theorem(100, 1e-12); }
TEST(Basis, addition_theorem_holds_to_1e_10_at_degree_1000) { expect_addition_theorem(1000, 1e-10); }

TEST(Basis, addition_theorem_for_two_directions_gives_legendre_polynomials) {
  std::mt19937_64 engine(3);
  const glm::dvec3 a = random_direction(engine), b = random_direction(engine);
  constexpr int kDegree = 100;
  std::vector<double> ya(101 * 101), yb(101 * 101);
  ASSERT_TRUE(evaluate(kDegree, a, ya));
  ASSERT_TRUE(evaluate(kDegree, b, yb));
  double before = 0.0, now = 1.0; // P_{l-1}, P_l of cos gamma
  for (int l = 0; l <= kDegree; ++l) {
    double sum = 0.0;
    for (int m = -l; m <= l; ++m)
      sum += ya[std::size_t(l * l + l + m)] * yb[std::size_t(l * l + l + m)];
    EXPECT_NEAR(sum * 4.0 * std::numbers::pi / (2.0 * l + 1.0), now, 1e-12) << l;
    const double next = ((2.0 * l + 1.0) * glm::dot(a, b) * now - l * before) / (l + 1.0);
    before = now;
    now = next;
  }
}

TEST(Basis, agrees_with_long_double_to_1e_13_of_the_row_at_degree_1000_also_near_the_poles) {
  constexpr int kDegree = 1000;
  std::vector<double> c(kDegree + 1), s(kDegree + 1);
  for (const double x : {0.0, 1e-12, 3e-4, 0.01, 0.5, 0.9, 0.99999, 1.0})
    for (const double sign : {1.0, -1.0})
      for (int m = 0; m <= kDegree; m += m < 20 ? 1 : 37) {
        const double z = sign * std::sqrt((1.0 - x) * (1.0 + x));
        const std::size_t count = std::size_t(kDegree - m + 1);
        ASSERT_TRUE(evaluate_order(m, kDegree, {x, 0.0, z}, std::span(c).first(count), std::span(s).first(count)));
        const long double sine = static_cast<long double>(x), cosine = std::sqrt((1.0L - sine) * (1.0L + sine));
        const auto p = legendre_reference(m, kDegree, cosine, sine);
        for (std::size_t i = 0; i < count; ++i) {
          const double parity = sign < 0.0 && i % 2 ? -1.0 : 1.0, root = m ? std::numbers::sqrt2 : 1.0;
          ASSERT_NEAR(c[i], parity * root * double(p[i]), 1e-13 * row_maximum(m + int(i))) << x << " " << m << " " << i;
          ASSERT_EQ(s[i], 0.0);
        }
      }
}

TEST(Basis, batch_equals_single_directions_whatever_the_count) {
  constexpr int kDegree = 40;
  for (const std::size_t count : {1u, 7u, 16u, 300u}) {
    std::mt19937_64 engine(count);
    std::vector<double> x, y, z, one(41 * 41), all(41 * 41 * count);
    for (std::size_t k = 0; k < count; ++k) {
      const glm::dvec3 n = random_direction(engine);
      x.push_back(n.x), y.push_back(n.y), z.push_back(n.z);
    }
    ASSERT_TRUE(evaluate_batch(kDegree, std::span<const double>(x), y, z, all));
    for (std::size_t k = 0; k < count; ++k) {
      ASSERT_TRUE(evaluate(kDegree, {x[k], y[k], z[k]}, one));
      for (std::size_t i = 0; i < one.size(); ++i)
        ASSERT_NEAR(all[i * count + k], one[i], 1e-13) << count << " " << k << " " << i;
    }
  }
}

// The stated limit of the pure-float path: 1e-5 of the row's largest value to degree 1000.
TEST(Basis, float_path_stays_within_1e_5_of_the_row_to_degree_1000) {
  constexpr int kDegree = 1000;
  std::mt19937_64 engine(4);
  std::vector<double> exact(1001 * 1001);
  std::vector<float> single(1001 * 1001);
  for (int k = 0; k < 3; ++k) {
    const glm::vec3 n(random_direction(engine));
    const glm::dvec3 same = glm::normalize(glm::dvec3(n));
    ASSERT_TRUE(evaluate(kDegree, n, single));
    ASSERT_TRUE(evaluate(kDegree, same, exact));
    for (int l = 0; l <= kDegree; ++l)
      for (int i = l * l; i < (l + 1) * (l + 1); ++i)
        ASSERT_NEAR(double(single[std::size_t(i)]), exact[std::size_t(i)], 1e-5 * row_maximum(l)) << l;
  }
}

TEST(Basis, nine_coefficient_batch_equals_the_closed_form_with_and_without_alignment) {
  constexpr std::size_t kCount = 1001;
  std::mt19937_64 engine(5);
  std::vector<float> x, y, z;
  for (std::size_t k = 0; k < kCount; ++k) {
    const glm::vec3 n(random_direction(engine));
    x.push_back(n.x), y.push_back(n.y), z.push_back(n.z);
  }
  for (const std::size_t stride : {kCount, std::size_t(1024)}) {
    std::vector<float> out(9 * stride, -7.0f);
    ASSERT_TRUE(evaluate9_batch(std::span<const float>(x), y, z, out, stride));
    for (std::size_t k = 0; k < kCount; ++k) {
      const auto expected = evaluate9<float>(x[k], y[k], z[k]);
      for (std::size_t i = 0; i < 9; ++i)
        ASSERT_NEAR(out[i * stride + k], expected[i], 3e-7f) << k << " " << i;
    }
    if (stride > kCount) {
      EXPECT_EQ(out[kCount], -7.0f) << "wrote beyond the count";
    }
  }
}

// Published implementations overflow 171! at order 86 in double: nothing happens there.
TEST(Basis, nothing_special_happens_at_order_86_and_172) {
  std::vector<double> y(201 * 201);
  ASSERT_TRUE(evaluate(200, glm::normalize(glm::dvec3(1, 2, 0.4)), y));
  for (const double v : y)
    ASSERT_TRUE(std::isfinite(v) && std::abs(v) <= row_maximum(200));
  for (const int l : {35, 86, 172}) {
    double band = 0.0;
    for (int i = l * l; i < (l + 1) * (l + 1); ++i)
      band += std::abs(y[std::size_t(i)]) > 1e-12 ? 1.0 : 0.0;
    EXPECT_GT(band, 1.8 * l) << "functions of the band vanished";
  }
}

} // namespace
} // namespace daylit::sh
