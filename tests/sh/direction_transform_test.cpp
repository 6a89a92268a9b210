#include "sh/direction_transform.h"

#include <gtest/gtest.h>

#include "sh/basis.h"
#include "sh/transform.h"
#include "support.h"

namespace daylit::sh {
namespace {

using namespace test;

struct Set {
  std::vector<double> x, y, z;
  void add(const glm::dvec3& n) { x.push_back(n.x), y.push_back(n.y), z.push_back(n.z); }
};

Set scattered(int count) {
  std::mt19937_64 engine(61);
  Set s;
  for (int k = 0; k < count; ++k)
    s.add(random_direction(engine));
  s.add({0, 0, 1}), s.add({0, 0, -1}), s.add({1, 0, 0}), s.add({0, 1, 0});
  s.add({0.6, 0, 0.8}), s.add({0, 0.6, -0.8}), s.add({-0.6, 0, 0.8}); // shared |z|
  return s;
}

TEST(DirectionTransform, synthesis_equals_evaluation_for_scattered_directions) {
  const Set s = scattered(40);
  constexpr int kDegree = 50;
  for (const int channels : {1, 3, 5}) {
    const auto c = random_numbers(51 * 51 * std::size_t(channels), 62);
    auto transform = *DirectionTransform::create(s.x, s.y, s.z, kDegree);
    std::vector<double> values(s.x.size() * std::size_t(channels)), basis(51 * 51);
    ASSERT_TRUE(transform.synthesise(c, channels, values));
    for (std::size_t k = 0; k < s.x.size(); ++k) {
      ASSERT_TRUE(evaluate(kDegree, {s.x[k], s.y[k], s.z[k]}, basis));
      for (std::size_t ch = 0; ch < std::size_t(channels); ++ch) {
        double sum = 0.0;
        for (std::size_t i = 0; i < basis.size(); ++i)
          sum += basis[i] * c[i * std::size_t(channels) + ch];
        ASSERT_NEAR(values[k * std::size_t(channels) + ch], sum, 1e-11) << k;
      }
    }
  }
}

TEST(DirectionTransform, analysis_is_the_transpose_of_synthesis) {
  const Set s = scattered(100);
  constexpr int kDegree = 64;
  auto transform = *DirectionTransform::create(s.x, s.y, s.z, kDegree);
  const auto x = random_numbers(65 * 65, 63), y = random_numbers(s.x.size(), 64);
  std::vector<double> ax(y.size()), aty(x.size());
  ASSERT_TRUE(transform.synthesise(x, 1, ax));
  ASSERT_TRUE(transform.analyse(y, std::vector<double>(y.size(), 1.0), 1, aty));
  double left = 0.0, right = 0.0;
  for (std::size_t i = 0; i < y.size(); ++i)
    left += ax[i] * y[i];
  for (std::size_t i = 0; i < x.size(); ++i)
    right += x[i] * aty[i];
  EXPECT_NEAR(left, right, 1e-11);
}

TEST(DirectionTransform, quadrature_over_the_samples_of_a_ring_grid_equals_the_ring_transform) {
  const auto grid = *gauss_legendre_grid(24);
  Set s;
  std::vector<double> weights;
  for (int i = 0; i < grid.rings(); ++i)
    for (int j = 0; j < grid.longitudes; ++j) {
      const double phi = 2.0 * std::numbers::pi * j / grid.longitudes, r = grid.sin_theta[std::size_t(i)];
      s.add({r * std::cos(phi), r * std::sin(phi), grid.cos_theta[std::size_t(i)]});
      weights.push_back(grid.weight_sr[std::size_t(i)]);
    }
  const auto image = random_numbers(grid.samples() * 3, 65);
  std::vector<double> rings(coefficient_count(24) * 3), direct(rings.size());
  ASSERT_TRUE(RingTransform::create(grid, 24)->analyse(interleaved(image.data(), grid.longitudes, 3), rings));
  ASSERT_TRUE(DirectionTransform::create(s.x, s.y, s.z, 24)->analyse(image, weights, 3, direct));
  EXPECT_LT(max_difference(rings, direct), 1e-13);
}

} // namespace
} // namespace daylit::sh
