// Graded grids: the same light as regular ones, only elsewhere.

#include <random>

#include <gtest/gtest.h>

#include "scene/volume/probe_planes.h"
#include "tests/scene/test_volumes.h"

namespace daylit {
namespace {

using test::graded;
using test::grid_volume;

/// Anywhere in and a little around the 4 x 5 x 3 m of the test rooms.
std::vector<glm::dvec3> points_around(int count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> x(-0.1, 4.1), y(-0.1, 5.1), z(-0.1, 3.1);
  std::vector<glm::dvec3> points;
  for (int i = 0; i < count; ++i)
    points.emplace_back(x(random), y(random), z(random));
  return points;
}

TEST(ProbePlanes, graded_grid_at_regular_coordinates_interpolates_with_the_same_bits) {
  const BasisVolume regular = grid_volume(test::room_with_table(), {6, 7, 5}, 1), same = graded(regular, 0.0);
  ASSERT_TRUE(same.probes.is_graded());
  const auto a = LightFieldSampler::make(regular), b = LightFieldSampler::make(same);
  ASSERT_TRUE(a && b);
  std::array<std::uint32_t, 8> probe_a{}, probe_b{};
  std::array<float, 8> weight_a{}, weight_b{};
  for (const glm::dvec3& p : points_around(3000, 1)) {
    ASSERT_EQ(a->weights(p, probe_a, weight_a), b->weights(p, probe_b, weight_b));
    ASSERT_EQ(probe_a, probe_b);
    ASSERT_EQ(weight_a, weight_b);
  }
}

TEST(ProbePlanes, point_stands_between_the_planes_that_a_search_one_by_one_finds) {
  const BasisVolume volume = graded(grid_volume(test::closed_room(), {6, 7, 5}, 1));
  const ProbePlanes planes(volume.probes);
  std::vector<glm::dvec3> points = points_around(2000, 2);
  for (int i = 0; i < 5; ++i) // on the planes, the outermost too
    points.push_back(volume.probes.origin + glm::dvec3(planes.along(0)[static_cast<std::size_t>(i + 1)],
                                                       planes.along(1)[static_cast<std::size_t>(i + 2)],
                                                       planes.along(2)[static_cast<std::size_t>(i)]));
  for (const glm::dvec3& p : points) {
    const GridPosition at = planes.locate(p);
    for (int k = 0; k < 3; ++k) {
      const std::vector<double>& c = planes.along(k);
      const double x = p[k] - volume.probes.origin[k];
      int cell = 0;
      while (cell + 2 < static_cast<int>(c.size()) && c[static_cast<std::size_t>(cell) + 1] <= x)
        ++cell;
      const double low = c[static_cast<std::size_t>(cell)], high = c[static_cast<std::size_t>(cell) + 1];
      ASSERT_EQ(at.cell[k], cell);
      ASSERT_EQ(at.fraction[k], (std::min(std::max(x, c.front()), c.back()) - low) / (high - low));
    }
  }
}

TEST(ProbePlanes, linear_field_is_exact_on_any_graded_grid_and_constant_beyond_it) {
  const auto value = [](const glm::dvec3& p) { return 1.0 + 0.3 * p.x - 0.7 * p.y + 0.2 * p.z; };
  for (const double by : {0.0, 0.3, 0.6, 0.9}) {
    const BasisVolume volume = graded(grid_volume(test::closed_room(), {6, 7, 5}, 1), by);
    const auto sampler = LightFieldSampler::make(volume);
    ASSERT_TRUE(sampler) << sampler.error().message();
    LightField field{std::vector<Sh9Rgb>(volume.probes.size())};
    const glm::dvec3 origin = volume.probes.origin;
    for (std::size_t i = 0; i < volume.probes.size(); ++i)
      field.probe[i][0] = Rgb(static_cast<float>(value(origin + glm::dvec3(volume.probes.positions[i]))));
    const glm::dvec3 first = origin + glm::dvec3(volume.probes.positions.front()),
                     last = origin + glm::dvec3(volume.probes.positions.back());
    for (const glm::dvec3& p : points_around(500, 3)) {
      const bool inside = volume.room.bounds().min.x < p.x && p.x < 4 && 0 < p.y && p.y < 5 && 0 < p.z && p.z < 3;
      const auto sh = sampler->sample(field, p);
      ASSERT_EQ(bool(sh), inside);
      const double got = sh ? static_cast<double>((*sh)[0].r) : value(glm::clamp(p, first, last));
      ASSERT_NEAR(got, value(glm::clamp(p, first, last)), 2e-5);
    }
  }
}

TEST(ProbePlanes, light_is_continuous_across_the_planes) {
  const BasisVolume volume = graded(grid_volume(test::closed_room(), {6, 7, 5}, 1));
  const auto sampler = LightFieldSampler::make(volume);
  ASSERT_TRUE(sampler);
  const LightField field = combine(volume, test::random_radiance(volume, 4));
  const ProbePlanes planes(volume.probes);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(0.05, 0.95);
  for (int k = 0; k < 3; ++k)
    for (const double plane : planes.along(k)) {
      glm::dvec3 p(4 * unit(random), 5 * unit(random), 3 * unit(random));
      p[k] = volume.probes.origin[k] + plane;
      glm::dvec3 low = p, high = p;
      low[k] -= 1e-7;
      high[k] += 1e-7;
      for (std::size_t i = 0; i < 9; ++i)
        EXPECT_NEAR((*sampler->sample(field, low))[i].r, (*sampler->sample(field, high))[i].r, 2e-4f);
    }
}

std::string refusal(const ProbeSet& probes) {
  const Result<void> good = check_grid(probes);
  return good ? std::string() : good.error().message();
}

TEST(ProbePlanes, coordinates_that_are_no_grid_are_refused_with_their_reason) {
  const ProbeSet good = graded(grid_volume(test::closed_room(), {6, 7, 5}, 1)).probes;
  ASSERT_EQ(refusal(good), "");
  const auto expect = [&](const char* reason, auto damage) {
    ProbeSet bad = good;
    damage(bad);
    EXPECT_NE(refusal(bad).find(reason), std::string::npos) << refusal(bad);
  };
  expect("do not increase", [](ProbeSet& p) { std::swap(p.planes[1][2], p.planes[1][3]); });
  expect("do not increase", [](ProbeSet& p) { p.planes[2][1] = p.planes[2][2]; });
  for (const double x : {std::nan(""), HUGE_VAL, -HUGE_VAL})
    expect("not finite", [&](ProbeSet& p) { p.planes[0][0] = x; });
  expect("as many coordinates", [](ProbeSet& p) { p.planes[0].pop_back(); });
  expect("as many coordinates", [](ProbeSet& p) { p.planes[2].push_back(100); });
  expect("as many coordinates", [](ProbeSet& p) { p.planes[1].clear(); });
  expect("mean distance", [](ProbeSet& p) { p.spacing.y *= 1.01; });
  expect("mean distance", [](ProbeSet& p) { p.planes[0].back() += 3; });
  expect("not where the grid says", [](ProbeSet& p) { p.planes[0][2] += 0.01; });
  expect("not where the grid says", [](ProbeSet& p) {
    for (double& x : p.planes[1])
      x += 1e9;
  });
}

} // namespace
} // namespace daylit
