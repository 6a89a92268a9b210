// Probe values fitted to linear interpolation: against the closed form of a parabola, and where none are taken.

#include "precompute/probe_fit.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace daylit::precompute {
namespace {

struct Row {
  ProbeSet grid;
  std::vector<std::size_t> all;
  std::vector<float> values;
};

/// 9 x 2 x 2 probes with a value for each x.
Row row_of_nine(float (*value)(int x)) {
  Row row;
  row.grid.is_grid = true;
  row.grid.count = {9, 2, 2};
  row.grid.spacing = glm::dvec3(1);
  for (int i = 0; i < 36; ++i) {
    row.all.push_back(static_cast<std::size_t>(i));
    row.grid.positions.emplace_back(i % 9, i / 9 % 2, i / 18);
    row.values.push_back(value(i % 9));
  }
  return row;
}

double in_mid_air(std::size_t) { return 100.0; }

TEST(ProbeFit, fitted_values_of_a_parabola_interpolate_with_0_41_of_the_error) {
  // f = x^2 at spacing h: samples err by h^2 t (1 - t), rms h^2 sqrt(1/30); lowered by h^2/6 they err by
  // h^2 (t (1 - t) - 1/6), rms h^2 sqrt(1/30 - 1/36). The ratio is sqrt(1/6) = 0.408.
  auto [grid, all, values] = row_of_nine([](int i) { return static_cast<float>(i * i); });
  ProbeFit::make(
      grid, all, [](std::size_t, std::size_t) { return true; }, in_mid_air)
      .apply(values, 1);
  double fitted = 0, sampled = 0;
  for (double x = 1.005; x < 7; x += 0.01) { // the outermost two are not between others
    const int i = static_cast<int>(x);
    const double t = x - i;
    const auto error = [&](double a, double b) { return (1 - t) * a + t * b - x * x; };
    fitted += std::pow(error(static_cast<double>(values[static_cast<std::size_t>(i)]),
                             static_cast<double>(values[static_cast<std::size_t>(i) + 1])),
                       2);
    sampled += std::pow(error(i * i, (i + 1) * (i + 1)), 2);
  }
  EXPECT_NEAR(std::sqrt(fitted / sampled), std::sqrt(1.0 / 6), 0.01);
}

TEST(ProbeFit, leaves_alone_what_is_not_between_two_others) {
  auto [grid, all, values] = row_of_nine([](int i) { return static_cast<float>(i * i); });
  ProbeFit::make(
      grid, all, [](std::size_t, std::size_t) { return true; }, in_mid_air)
      .apply(values, 1);
  EXPECT_EQ(values[0], 0.0f);
  EXPECT_EQ(values[8], 64.0f);
}

TEST(ProbeFit, nothing_passes_between_probes_that_do_not_see_each_other) {
  // A wall between the probes 4 and 5: each side keeps its own values.
  auto [grid, all, values] = row_of_nine([](int i) { return i < 5 ? 0.0f : 100.0f; });
  const std::vector<float> before = values;
  const auto sees = [](std::size_t a, std::size_t b) { return (a % 9 < 5) == (b % 9 < 5); };
  ProbeFit::make(grid, all, sees, in_mid_air).apply(values, 1);
  EXPECT_EQ(values, before);
}

TEST(ProbeFit, leaves_alone_what_is_nearer_to_a_surface_than_a_step) {
  const auto [grid, all, before] = row_of_nine([](int i) { return static_cast<float>(i * i); });
  std::vector<float> after = before;
  const auto off_m = [](std::size_t i) { return i % 9 == 4 ? 0.99 : 1.01; };
  ProbeFit::make(
      grid, all, [](std::size_t, std::size_t) { return true; }, off_m)
      .apply(after, 1);
  EXPECT_EQ(after[4], before[4]);
  for (const std::size_t i : {3u, 5u})
    EXPECT_NEAR(after[i], before[i] - 1.0f / 6, 1e-5f) << i; // h^2 f'' / 12
}

TEST(ProbeFit, takes_nothing_of_a_neighbour_close_above_a_bright_surface) {
  // Probes 0 to 3 stand 2 cm above a sunlit box, the others beside it at the height of its top.
  const auto [grid, all, before] = row_of_nine([](int i) { return i < 4 ? 200.0f : 20.0f; });
  std::vector<float> after = before;
  const auto off_m = [](std::size_t i) { return i % 9 < 4 ? 0.02 : static_cast<double>(i % 9) - 3.5; };
  ProbeFit::make(
      grid, all, [](std::size_t, std::size_t) { return true; }, off_m)
      .apply(after, 1);
  EXPECT_EQ(after, before);
}

} // namespace
} // namespace daylit::precompute
