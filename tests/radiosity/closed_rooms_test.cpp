// Closed rooms of almost white walls: hundreds of bounces, driven by a surface that emits.

#include <cmath>
#include <cstdio>

#include <gtest/gtest.h>

#include "radiosity/elements.h"
#include "radiosity/emission.h"
#include "radiosity/patches.h"
#include "radiosity/solve.h"
#include "tests/radiosity/rooms.h"

namespace daylit::radiosity {
namespace {

const Progress kSilent = [](const std::string&, double) { return true; };

class ClosedRoom : public ::testing::TestWithParam<float> {};

/// A flux of 1 W per channel leaves one patch. Every bounce keeps rho of it: the walls receive 1 / (1 - rho) in all.
TEST_P(ClosedRoom, total_received_flux_is_emitted_flux_over_one_minus_reflectance) {
  const float rho = GetParam();
  Room room = testing::grey_room(rho);
  testing::add_box(room, {0, 0, 0}, {4, 5, 2.8}, 0b111111u, true);
  testing::add_box(room, {1, 1, 0}, {2, 2, 0.8}, 0b111110u, false);
  const auto mesh = mesh_patches(room, {.target_patches = 800});
  const auto scene = patch_scene(*mesh);
  const auto rays = RayScene::build(room);
  const std::vector<Aperture> seed = {
      {.corners = {{3, 4, 1.5}, {3.001, 4, 1.5}, {3, 4.001, 1.5}}, .inward = {0, 0, 1}}};
  const ElementSet set = find_elements(room, *mesh, *scene, seed);
  const auto exchange = exchange_areas(set, *mesh, room, *rays, {}, kSilent);
  ASSERT_TRUE(exchange);
  std::vector<Rgb> exitance(set.elements.size(), Rgb(0.0f));
  exitance[7] = Rgb(static_cast<float>(1.0 / set.elements[7].area_m2));
  const auto light = emitted_light(set, *exchange, exitance);
  ASSERT_TRUE(light);
  SolveReport report;
  const auto b = solve_radiosity(set, *exchange, *light, {}, kSilent, &report);
  ASSERT_TRUE(b) << b.error().message();
  double received = 0;
  for (std::size_t i = 0; i < set.elements.size(); ++i) {
    ASSERT_TRUE(std::isfinite(b->row(i)[0]));
    received += set.elements[i].area_m2 * static_cast<double>(b->row(i)[0] / rho);
  }
  const double error = received * static_cast<double>(1.0f - rho) - 1.0;
  std::printf("reflectance %g: %d iterations, residual %.1e, flux off by %.2e\n", static_cast<double>(rho),
              report.iterations, report.worst_residual, error);
  // The emitter's row sum is off by a few 1e-4; what all rows miss of 1 in the mean (1e-5) is lost at every bounce.
  EXPECT_LT(std::abs(error), 5e-4 + 1e-5 / static_cast<double>(1.0f - rho));
  EXPECT_LT(report.iterations, 200);
}

INSTANTIATE_TEST_SUITE_P(Reflectance, ClosedRoom, ::testing::Values(0.5f, 0.9f, 0.99f, 0.999f));

} // namespace
} // namespace daylit::radiosity
