// Graded grids: where their planes stand, and what that is good for.

#include <cmath>
#include <numeric>

#include <gtest/gtest.h>

#include "precompute/probe_density.h"
#include "precompute/probe_fit.h"
#include "precompute/probes.h"
#include "scene/volume/probe_planes.h"
#include "tests/scene/test_volumes.h"

namespace daylit::precompute {
namespace {

/// The piecewise linear density at a share of the way, no less than half of the mean of its values.
double density_at(const std::vector<double>& density, double share) {
  const double least = 0.5 * std::accumulate(density.begin(), density.end(), 0.0) / double(density.size());
  const double x = share * double(density.size() - 1);
  const auto i = std::min(static_cast<std::size_t>(x), density.size() - 2);
  return std::lerp(std::max(density[i], least), std::max(density[i + 1], least), x - double(i));
}

TEST(ProbeDensity, neighbouring_planes_have_equally_much_density_between_them) {
  for (const std::vector<double>& density :
       {std::vector<double>{1, 3, 2}, {1, 1}, {5, 1, 1, 1, 8}, {1e-9, 1, 0}, {0.3, 0.3, 2}}) {
    const std::vector<double> planes = planes_of(density, 14, -2.0, 3.0);
    ASSERT_EQ(planes.size(), 14u);
    EXPECT_EQ(planes.front(), -2.0);
    EXPECT_EQ(planes.back(), 3.0);
    std::vector<double> between;
    for (std::size_t i = 0; i + 1 < planes.size(); ++i) {
      ASSERT_LT(planes[i], planes[i + 1]);
      double sum = 0;
      for (int k = 0; k < 2000; ++k)
        sum += density_at(density, (std::lerp(planes[i], planes[i + 1], (k + 0.5) / 2000) + 2.0) / 5.0);
      between.push_back(sum * (planes[i + 1] - planes[i]));
      EXPECT_LT(planes[i + 1] - planes[i], 2.1 * 5.0 / 13);
    }
    for (const double one : between)
      EXPECT_NEAR(one / between[0], 1.0, 1e-5);
  }
}

TEST(ProbeDensity, grid_without_density_or_with_an_equal_one_is_the_regular_grid) {
  const Bounds bounds = test::closed_room().bounds();
  const ProbeSet regular = *make_grid(bounds, glm::ivec3(0), 0.3),
                 equal = *make_grid(bounds, glm::ivec3(0), 0.3, {{{2, 2}}});
  EXPECT_FALSE(regular.is_graded());
  EXPECT_TRUE(equal.is_graded());
  EXPECT_EQ(regular.count, equal.count);
  EXPECT_TRUE(check_grid(equal));
  for (std::size_t i = 0; i < regular.size(); ++i)
    ASSERT_NEAR(glm::distance(regular.positions[i], equal.positions[i]), 0.0f, 1e-6f);
}

/// Light that falls with the distance from x = 0, the same in all regions of a sky that are stored.
float light(const glm::dvec3& p) { return static_cast<float>(std::exp(-p.x / 0.4)); }

BasisVolume lit_from_one_side(BasisVolume volume) {
  const ProbeSet& probes = volume.probes;
  for (std::size_t i = 0; i < volume.basis.size(); ++i)
    volume.basis[i] = light(probes.origin + glm::dvec3(probes.positions[i % volume.row_floats() / 27]));
  return volume;
}

/// Rms over a line across the room of what interpolation between the probes' light is off by.
double interpolation_error(const ProbeSet& probes) {
  BasisVolume volume = test::grid_volume(test::closed_room(), {2, 2, 2}, 1);
  volume.probes = probes;
  volume.probes.valid.assign(probes.size(), 1);
  volume.basis.assign(volume.row_floats(), 0.0f);
  volume = lit_from_one_side(volume);
  const auto sampler = LightFieldSampler::make(volume);
  EXPECT_TRUE(sampler);
  const LightField field = combine(volume, std::vector<Rgb>(64, Rgb(1.0f)));
  double sum = 0;
  for (double x = 0.3; x < 3.7; x += 0.01)
    sum += std::pow((*sampler->sample(field, {x, 2.0, 1.5}))[4].g - light({x, 2.0, 1.5}), 2);
  return std::sqrt(sum / 340);
}

TEST(ProbeDensity, probes_gather_where_light_is_curved_and_the_same_number_errs_less) {
  const BasisVolume coarse = lit_from_one_side(test::grid_volume(test::closed_room(), {10, 12, 8}, 3));
  const auto density = probe_density(coarse);
  ASSERT_TRUE(density);
  EXPECT_GT((*density)[0].front(), 1.5 * (*density)[0].back());
  EXPECT_TRUE((*density)[2].empty()) << "light is the same all the way up: nothing to grade by";
  const ProbeSet regular = *make_grid(coarse.room.bounds(), {14, 6, 5}, 0.3),
                 graded = *make_grid(coarse.room.bounds(), {14, 6, 5}, 0.3, *density);
  EXPECT_LT(graded.planes[0][1] - graded.planes[0][0], 0.8 * (graded.planes[0][13] - graded.planes[0][12]));
  EXPECT_LT(interpolation_error(graded), 0.8 * interpolation_error(regular));
}

/// Two halves, parted by a sheet between two planes of probes: light 1 in the right one.
BasisVolume two_halves(float (*left)(float x)) {
  test::RoomBuilder b;
  const auto grey = b.material("grey");
  b.box({0, 0, 0}, {4, 5, 3}, grey);
  b.quad({2.05, 0, 0}, {2.05, 5, 0}, {2.05, 5, 3}, {2.05, 0, 3}, grey);
  BasisVolume volume = test::grid_volume(b.room, {9, 6, 5}, 2);
  for (std::size_t i = 0; i < volume.basis.size(); ++i) {
    const float x = volume.probes.positions[i % volume.row_floats() / 27].x;
    volume.basis[i] = x < 0.05f ? left(x) : 1.0f;
  }
  return volume;
}

TEST(ProbeDensity, what_stands_behind_a_wall_or_furniture_is_no_curvature) {
  const auto density = probe_density(two_halves([](float) { return 7.0f; }));
  ASSERT_TRUE(density);
  EXPECT_FALSE(is_graded(*density));
}

TEST(ProbeDensity, the_last_plane_before_a_wall_is_as_dense_as_the_one_beside_it) {
  const auto density = probe_density(two_halves([](float x) { return std::exp(x / 0.4f); }));
  ASSERT_TRUE(density);
  EXPECT_GT((*density)[0][3], 0.0);
  EXPECT_EQ((*density)[0][4], (*density)[0][3]);
}

double in_mid_air(std::size_t) { return 100.0; }

TEST(ProbeFit, fitted_values_of_a_parabola_interpolate_better_on_an_uneven_grid_too) {
  ProbeSet grid;
  grid.is_grid = true;
  grid.count = {12, 2, 2};
  grid.spacing = glm::dvec3(9.0 / 11, 1, 1);
  grid.planes = {planes_of({1, 2.5, 1}, 12, 0, 9), {0, 1}, {0, 1}};
  std::vector<std::size_t> all(48);
  std::iota(all.begin(), all.end(), 0u);
  std::vector<float> fitted;
  for (std::size_t i = 0; i < 48; ++i) {
    const double x = grid.planes[0][i % 12];
    grid.positions.emplace_back(x, i / 12 % 2, i / 24);
    fitted.push_back(static_cast<float>(x * x));
  }
  ASSERT_TRUE(check_grid(grid));
  const ProbeFit fit = ProbeFit::make(
      grid, all, [](std::size_t, std::size_t) { return true; }, in_mid_air);
  const std::vector<float> sampled = fitted;
  fit.apply(fitted, 1);
  std::vector<float> some(3); // the second way to the same values
  fit.apply(
      std::vector<std::uint32_t>{0, 5, 11}, 1, [&](std::uint32_t p, float* v) { *v = sampled[p]; }, some.data());
  EXPECT_NEAR(some[0], fitted[0], 1e-5f);
  EXPECT_NEAR(some[1], fitted[5], 1e-5f);
  EXPECT_NEAR(some[2], fitted[11], 1e-5f);
  double with = 0, without = 0;
  const ProbePlanes planes(grid);
  for (double x = grid.planes[0][1] + 0.005; x < grid.planes[0][10]; x += 0.01) {
    const GridPosition at = planes.locate({x, 0, 0});
    const auto i = static_cast<std::size_t>(at.cell.x);
    const auto error = [&](const std::vector<float>& v) {
      return std::lerp(double(v[i]), double(v[i + 1]), at.fraction.x) - x * x;
    };
    with += error(fitted) * error(fitted);
    without += error(sampled) * error(sampled);
  }
  EXPECT_NEAR(std::sqrt(with / without), std::sqrt(1.0 / 6), 0.03); // as on a regular grid (plan_test)
}

} // namespace
} // namespace daylit::precompute
