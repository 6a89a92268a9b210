#include "sh/irradiance.h"

#include <gtest/gtest.h>

#include "sh/basis.h"
#include "sh/zonal.h"
#include "support.h"

namespace daylit::sh {
namespace {

using namespace test;

TEST(Irradiance, uniform_radiance_one_gives_pi) {
  const std::array<double, 9> sky{std::sqrt(4.0 * std::numbers::pi)};
  EXPECT_NEAR(irradiance9(sky, glm::dvec3(0.6, 0.0, 0.8)), std::numbers::pi, 1e-14);
}

// One directional light, order 3: peak 1.0625, opposite side 0.0625, 3/32 at the terminator.
TEST(Irradiance, nine_coefficients_of_a_directional_light_have_the_known_extremes) {
  const glm::dvec3 light(0, 0, 1);
  const auto y = evaluate9<double>(light);
  EXPECT_NEAR(irradiance9(y, light), 1.0625, 1e-14);
  EXPECT_NEAR(irradiance9(y, -light), 0.0625, 1e-14);
  EXPECT_NEAR(irradiance9(y, glm::dvec3(1, 0, 0)), 3.0 / 32.0, 1e-14);
}

struct Remainder {
  double rms, worst;
};
/// Directly summed difference between all bands and the first three, over random normals.
Remainder sampled_remainder(const std::vector<double>& c, int degree) {
  auto bands = *clamped_cosine_bands(degree);
  bands[0] = bands[1] = bands[2] = 0.0;
  auto e = c;
  EXPECT_TRUE(convolve(bands, 1, e));
  std::mt19937_64 engine(41);
  std::vector<double> y(c.size());
  Remainder r{0.0, 0.0};
  constexpr int kSamples = 5000;
  for (int k = 0; k < kSamples; ++k) {
    EXPECT_TRUE(evaluate(degree, random_direction(engine), y));
    double sum = 0.0;
    for (std::size_t i = 0; i < c.size(); ++i)
      sum += e[i] * y[i];
    r.rms += sum * sum / kSamples;
    r.worst = std::max(r.worst, std::abs(sum));
  }
  r.rms = std::sqrt(r.rms);
  return r;
}

TEST(Irradiance, what_order_three_leaves_out_is_exact_in_the_mean_and_bounded_everywhere) {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const auto c = random_numbers(81, seed);
    const auto bound = *order3_remainder(c);
    const auto seen = sampled_remainder(c, 8);
    EXPECT_NEAR(seen.rms, bound.rms, 0.06 * bound.rms);
    EXPECT_LE(seen.worst, bound.max_bound);
    EXPECT_GT(seen.worst, 0.2 * bound.max_bound) << "the bound is not sharp enough to be of use";
  }
}

TEST(Irradiance, a_point_light_reaches_three_thirtyseconds_at_its_terminator) {
  constexpr int kDegree = 60;
  std::vector<double> c(61 * 61, 0.0);
  for (int l = 0; l <= kDegree; ++l)
    c[std::size_t(l * l + l)] = row_maximum(l);
  const auto bound = *order3_remainder(c);
  EXPECT_NEAR(bound.max_bound_nonnegative, 3.0 / 32.0, 1e-14); // integral of L is 1
  EXPECT_EQ(bound.max(), std::min(bound.max_bound, 3.0 / 32.0));
  // rms in closed form: the square of the clamped cosine less its first bands, 2 pi/3 - (pi/4 + pi/3 + 5 pi/64), / 4
  // pi.
  const double all = 2.0 / 3.0 - 1.0 / 4.0 - 1.0 / 3.0 - 5.0 / 64.0;
  EXPECT_NEAR(bound.rms, std::sqrt(all / 4.0 / (4.0 * std::numbers::pi) * 4.0 * std::numbers::pi), 1e-4);
}

} // namespace
} // namespace daylit::sh
