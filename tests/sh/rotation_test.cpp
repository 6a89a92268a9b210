#include "sh/rotation.h"

#include <gtest/gtest.h>

#include "sh/basis.h"
#include "support.h"

namespace daylit::sh {
namespace {

using namespace test;

double series(std::span<const double> c, int degree, const glm::dvec3& n) {
  std::vector<double> y(c.size());
  EXPECT_TRUE(evaluate(degree, n, y));
  double sum = 0.0;
  for (std::size_t i = 0; i < c.size(); ++i)
    sum += c[i] * y[i];
  return sum;
}

/// Largest |rotated series at n - series at R^T n| in units of the root-sum-square of its terms.
double rotation_error(const glm::dmat3& r, int degree) {
  const auto c = random_numbers(std::size_t(degree + 1) * std::size_t(degree + 1), 21);
  auto rotated = c;
  EXPECT_TRUE(rotate(r, degree, 1, rotated));
  std::mt19937_64 engine(22);
  double norm = 0.0, worst = 0.0;
  for (const double v : c)
    norm += v * v;
  const double scale = std::sqrt(norm / (4.0 * std::numbers::pi));
  for (int k = 0; k < 5; ++k) {
    const glm::dvec3 n = random_direction(engine);
    const double there = series(rotated, degree, n);
    worst = std::max(worst, std::abs(there - series(c, degree, glm::normalize(glm::transpose(r) * n))) / scale);
  }
  return worst;
}

TEST(Rotation, equals_reevaluation_in_the_rotated_frame_to_1e_12_at_degree_100) {
  std::mt19937_64 engine(20);
  for (int k = 0; k < 6; ++k)
    EXPECT_LT(rotation_error(turn(random_direction(engine), 0.6 * k), 100), 1e-12) << k;
}
TEST(Rotation, equals_reevaluation_in_the_rotated_frame_to_1e_10_at_degree_1000) {
  std::mt19937_64 engine(23);
  EXPECT_LT(rotation_error(turn(random_direction(engine), 2.0), 1000), 1e-10);
}

TEST(Rotation, special_angles_and_tiny_tilts_lose_nothing) {
  constexpr double pi = std::numbers::pi;
  for (const double angle : {0.0, 1e-300, 1e-15, 1e-9, 1e-6, pi / 2, pi - 1e-9, pi, 3.0, -pi / 2})
    for (const glm::dvec3 axis :
         {glm::dvec3(0, 0, 1), glm::dvec3(0, 1, 0), glm::dvec3(1, 0, 0), glm::normalize(glm::dvec3(1, 2, 3))})
      EXPECT_LT(rotation_error(turn(axis, angle), 30), 1e-12) << angle << " about " << axis.x << axis.y << axis.z;
}

TEST(Rotation, the_degree_one_band_turns_like_a_vector) {
  const glm::dmat3 r = turn(glm::normalize(glm::dvec3(1, -2, 0.5)), 1.1);
  std::vector<double> c{0.5, 0.2, -0.7, 0.4}; // constant, y, z, x
  ASSERT_TRUE(rotate(r, 1, 1, c));
  const glm::dvec3 expected = r * glm::dvec3(0.4, 0.2, -0.7);
  EXPECT_NEAR(c[0], 0.5, 1e-15);
  EXPECT_NEAR(c[3], expected.x, 1e-15);
  EXPECT_NEAR(c[1], expected.y, 1e-15);
  EXPECT_NEAR(c[2], expected.z, 1e-15);
}

TEST(Rotation, keeps_the_energy_of_every_band_and_comes_back) {
  constexpr int kDegree = 120;
  std::mt19937_64 engine(24);
  const glm::dmat3 r = turn(random_direction(engine), 1.9);
  const auto c = random_numbers(121 * 121 * 3, 25);
  auto d = c;
  ASSERT_TRUE(rotate(r, kDegree, 3, d));
  for (std::size_t l = 0; l <= kDegree; ++l) {
    double before = 0.0, after = 0.0;
    for (std::size_t i = l * l * 3; i < (l + 1) * (l + 1) * 3; ++i) {
      before += c[i] * c[i];
      after += d[i] * d[i];
    }
    EXPECT_NEAR(after / before, 1.0, 1e-13) << l;
  }
  ASSERT_TRUE(rotate(glm::transpose(r), kDegree, 3, d));
  EXPECT_LT(max_difference(c, d), 1e-12);
}

} // namespace
} // namespace daylit::sh
