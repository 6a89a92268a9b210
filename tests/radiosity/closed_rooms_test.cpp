// Closed rooms of almost white walls: hundreds of bounces, driven by a surface that emits.

#include <cmath>
#include <cstdio>

#include <gtest/gtest.h>

#include "bench/selftest/emission.h"
#include "radiosity/patches.h"
#include "radiosity/row_closure.h"
#include "radiosity/solve.h"
#include "radiosity/surface_mesh.h"
#include "tests/radiosity/dense_matrix.h"
#include "tests/radiosity/rooms.h"

namespace daylit::radiosity {
namespace {

const Progress kSilent = [](const std::string&, double) { return true; };

/// A closed room with a box in it, up to its form factors.
struct Problem {
  PatchSet set;
  ExchangeMatrix exchange;
};

Problem closed_room(float rho) {
  Room room = testing::grey_room(rho);
  testing::add_box(room, {0, 0, 0}, {4, 5, 2.8}, 0b111111u, true);
  testing::add_box(room, {1, 1, 0}, {2, 2, 0.8}, 0b111110u, false);
  const auto mesh = mesh_surfaces(room, {.target_facets = 800});
  const auto scene = facet_scene(*mesh);
  const auto rays = RayScene::build(room);
  const std::vector<Aperture> seed = {
      {.corners = {{3, 4, 1.5}, {3.001, 4, 1.5}, {3, 4.001, 1.5}}, .inward = {0, 0, 1}}};
  Problem p{find_patches(room, *mesh, *scene, seed), {}};
  auto exchange = exchange_areas(p.set, *mesh, room, *rays, {}, kSilent);
  EXPECT_TRUE(exchange);
  p.exchange = std::move(*exchange);
  return p;
}

/// A flux of 1 W per channel leaves one facet. Every bounce keeps rho of it: the walls receive 1 / (1 - rho) in all.
/// The relative error of that.
double flux_error(const Problem& p, float rho) {
  const std::vector<Patch>& patches = p.set.patches;
  std::vector<Rgb> exitance(patches.size(), Rgb(0.0f));
  exitance[7] = Rgb(static_cast<float>(1.0 / patches[7].area_m2));
  const auto light = bench::emitted_light(p.set, p.exchange, exitance);
  SolveReport report;
  const auto b = solve_radiosity(p.set, p.exchange, *light, {.tolerance = 1e-6}, kSilent, &report);
  if (!b) {
    ADD_FAILURE() << b.error().message();
    return 1.0;
  }
  double received = 0;
  for (std::size_t i = 0; i < patches.size(); ++i)
    received += patches[i].area_m2 * static_cast<double>(b->row(i)[0] / rho);
  const double error = received * static_cast<double>(1.0f - rho) - 1.0;
  std::printf("reflectance %g: %d iterations, residual %.1e, flux off by %.2e\n", static_cast<double>(rho),
              report.iterations, report.worst_residual, error);
  EXPECT_LT(report.iterations, 200);
  return error;
}

class ClosedRoom : public ::testing::TestWithParam<float> {};

TEST_P(ClosedRoom, total_received_flux_is_emitted_flux_over_one_minus_reflectance) {
  const float rho = GetParam();
  // The emitter's row sum is off by a few 1e-4; what all rows miss of 1 in the mean (1e-5) is lost at every bounce.
  EXPECT_LT(std::abs(flux_error(closed_room(rho), rho)), 5e-4 + 1e-5 / static_cast<double>(1.0f - rho));
}

TEST_P(ClosedRoom, with_closed_rows_no_bounce_loses_flux) {
  const float rho = GetParam();
  Problem p = closed_room(rho);
  const RowClosure closure = close_rows(p.set, std::vector<float>(p.set.patches.size(), 0.0f), {}, p.exchange);
  EXPECT_LT(closure.worst, 1e-3);
  EXPECT_GT(closure.worst, 1e-5);
  EXPECT_EQ(closure.left, 0u);
  const std::vector<double> sums = p.exchange.row_sums();
  for (std::size_t i = 0; i < sums.size(); ++i)
    ASSERT_NEAR(sums[i] / p.set.patches[i].area_m2, 1.0, 1e-5) << i;
  EXPECT_LT(std::abs(flux_error(p, rho)), 1e-4);
}

TEST(RowClosure, a_row_off_by_more_than_noise_stays_as_it_is) {
  Problem p = closed_room(0.5f);
  std::vector<float> opening(p.set.patches.size(), 0.0f);
  opening[11] = 0.05f; // a lie
  const std::vector<double> before = p.exchange.row_sums();
  const RowClosure closure = close_rows(p.set, opening, {}, p.exchange);
  EXPECT_EQ(closure.left, 1u);
  EXPECT_NEAR(closure.worst, 0.05, 1e-3);
  EXPECT_NEAR(p.exchange.row_sums()[11] / before[11], 1.0, 1e-3);
  const std::vector<float> g = dense(p.exchange);
  const std::size_t n = opening.size();
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < i; ++j)
      ASSERT_EQ(g[i * n + j], g[j * n + i]); // reciprocity stays exact
}

INSTANTIATE_TEST_SUITE_P(Reflectance, ClosedRoom, ::testing::Values(0.5f, 0.9f, 0.99f, 0.999f));

} // namespace
} // namespace daylit::radiosity
