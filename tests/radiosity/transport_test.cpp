#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "radiosity/energy.h"
#include "radiosity/polygon_kernel.h"
#include "radiosity/solve.h"
#include "scene/sky/sky_partition.h"
#include "tests/radiosity/solved_room.h"

namespace daylit::radiosity {
namespace {

using daylit::testing::add_box;
using daylit::testing::grey_room;
using daylit::testing::room_with_window_hole;
using testing::coloured_room;
using testing::kSilent;
using testing::prepare;
using testing::seed_at;
using testing::Solved;
constexpr double kPi = std::numbers::pi;

FirstBounce emission(const Solved& s, float value) {
  FirstBounce f;
  f.patches = s.set.patches.size();
  f.region = {0};
  f.irradiance.assign(f.patches * 3, value);
  f.opening.assign(f.patches, 0.0f);
  return f;
}

double row_sum(const Solved& s, std::size_t i) {
  return std::accumulate(s.row(i), s.row(i) + s.set.patches.size(), 0.0) / s.set.patches[i].area_m2;
}

TEST(FormFactors, rows_of_a_closed_convex_room_sum_to_one) {
  Room room = grey_room(0.5f);
  add_box(room, {0, 0, 0}, {4, 3, 2.5}, 0b111111u, true);
  const Solved s = prepare(room, 800, seed_at({2, 1.5, 1}));
  double worst = 0;
  for (std::size_t i = 0; i < s.set.patches.size(); ++i)
    worst = std::max(worst, std::abs(row_sum(s, i) - 1.0));
  EXPECT_LT(worst, 1e-3);
  RecordProperty("worst_closure", std::to_string(worst));
}

TEST(FormFactors, rows_of_a_furnished_room_with_a_hole_close_with_the_opening) {
  Room room = room_with_window_hole(0.5f);
  add_box(room, {1, 1, 0}, {2, 2, 0.8}, 0b111110u, false); // a box without bottom on the floor
  const Solved s = prepare(room, 1500);
  const auto light = first_bounce(s.set, s.mesh, s.scene, s.apertures, *SkyPartition::uniform(64), kSilent);
  ASSERT_TRUE(light);
  double squares = 0, area = 0;
  for (std::size_t i = 0; i < s.set.patches.size(); ++i) {
    const double a = s.set.patches[i].area_m2, c = row_sum(s, i) + static_cast<double>(light->opening[i]) - 1.0;
    squares += a * c * c;
    area += a;
  }
  EXPECT_LT(std::sqrt(squares / area), 4e-3); // 64 rays per partly hidden pair
}

TEST(FormFactors, matrix_is_exactly_symmetric_and_thread_count_changes_no_bit) {
  set_thread_count(1);
  const Solved one = prepare(room_with_window_hole(0.5f), 500);
  set_thread_count(2);
  const Solved two = prepare(room_with_window_hole(0.5f), 500);
  set_thread_count(0);
  EXPECT_EQ(one.dense, two.dense);
  for (std::size_t i = 0; i < one.set.patches.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      ASSERT_EQ(one.row(i)[j], one.row(j)[i]);
}

TEST(Patches, both_sides_of_a_free_standing_panel_and_no_outside_of_a_wall_are_unknowns) {
  Room room = room_with_window_hole(0.5f);
  daylit::testing::add_quad(room, {1, 3, 0}, {3, 3, 0}, {3, 3, 1.5}, {1, 3, 1.5});
  const Solved s = prepare(room, 600);
  double panel = 0, walls = 0;
  for (const Patch& e : s.set.patches) {
    const glm::dvec3 m = (e.corner[0] + e.corner[1] + e.corner[2]) / 3.0 + s.mesh.origin;
    (std::abs(m.y - 3) < 1e-9 && m.x > 1 && m.x < 3 && m.z < 1.5 ? panel : walls) += e.area_m2;
  }
  EXPECT_NEAR(panel, 2 * 3.0, 1e-6); // both its sides
  EXPECT_NEAR(walls, 2 * (4 * 5 + 4 * 2.8 + 5 * 2.8) - 1.6 * 1.2, 1e-6);
}

TEST(Patches, floor_under_furniture_and_the_inside_of_furniture_are_dark) {
  Room room = room_with_window_hole(0.5f);
  add_box(room, {1, 1, 0}, {2, 2, 0.8}, 0b111110u, false);
  const Solved s = prepare(room, 800);
  double area = 0;
  for (const Patch& e : s.set.patches)
    area += e.area_m2;
  const double walls = 2 * (4 * 5 + 4 * 2.8 + 5 * 2.8) - 1.6 * 1.2, box = 4 * 0.8 + 1.0, footprint = 1.0;
  EXPECT_NEAR(area, walls + box - footprint, 1e-6);
}

TEST(Solve, furnace_reads_one_over_one_minus_reflectance_everywhere) {
  // Every surface receives irradiance 1 of its own: E = 1 + rho E, so E = 1 / (1 - rho), B = rho / (1 - rho).
  for (const float rho : {0.2f, 0.8f, 0.95f}) {
    Room room = grey_room(rho);
    add_box(room, {0, 0, 0}, {2, 3, 2.5}, 0b111111u, true);
    const Solved s = prepare(room, 600, seed_at({1, 1.5, 1}));
    const auto b = solve_radiosity(s.set, s.exchange, emission(s, 1.0f), {}, kSilent);
    ASSERT_TRUE(b) << b.error().message();
    const double expected = static_cast<double>(rho / (1.0f - rho));
    double worst = 0;
    for (std::size_t i = 0; i < s.set.patches.size(); ++i)
      worst = std::max(worst, std::abs(static_cast<double>(b->row(i)[0]) / expected - 1.0));
    EXPECT_LT(worst, 1e-3 / static_cast<double>(1.0f - rho)) << rho; // closure of 1e-3 amplified by the bounces
  }
}

TEST(Solve, mean_illuminance_of_a_closed_cube_is_flux_over_area_times_one_minus_reflectance) {
  // CIE 171:2006, 5.8: any closed room of uniform reflectance, any distribution of the first light.
  Room room = grey_room(0.7f);
  add_box(room, {0, 0, 0}, {4, 4, 4}, 0b111111u, true);
  const Solved s = prepare(room, 900, seed_at({2, 2, 2}));
  FirstBounce light = emission(s, 0.0f);
  light.irradiance[3 * 5] = light.irradiance[3 * 5 + 1] = light.irradiance[3 * 5 + 2] =
      static_cast<float>(10000.0 / s.set.patches[5].area_m2); // 10,000 lm on one facet
  const auto b = solve_radiosity(s.set, s.exchange, light, {}, kSilent);
  ASSERT_TRUE(b);
  double flux = 0;
  for (std::size_t i = 0; i < s.set.patches.size(); ++i)
    flux += s.set.patches[i].area_m2 * static_cast<double>(b->row(i)[0]) / 0.7;
  EXPECT_NEAR(flux / 96.0 / (10000.0 / (96.0 * 0.3)), 1.0, 2e-3); // 347.222 lx in total
}

TEST(FirstBounce, uniform_sky_through_a_hole_is_pi_times_the_form_factor) {
  const Solved s = prepare(room_with_window_hole(0.5f), 500);
  const auto light = first_bounce(s.set, s.mesh, s.scene, s.apertures, *SkyPartition::uniform(64), kSilent);
  ASSERT_TRUE(light);
  const std::array<glm::dvec3, 4> hole = {glm::dvec3(1.2, 0, 0.9), {1.2, 0, 2.1}, {2.8, 0, 2.1}, {2.8, 0, 0.9}};
  for (std::size_t i = 0; i < s.set.patches.size(); i += 7) {
    const Patch& e = s.set.patches[i];
    std::array<glm::dvec3, 3> world = e.corner;
    for (glm::dvec3& c : world)
      c += s.mesh.origin;
    const double expected = kPi * exchange_area_unoccluded(world, e.normal, hole, {0, 1, 0}) / e.area_m2;
    double sum = 0;
    for (std::size_t k = 0; k < light->columns(); ++k)
      sum += static_cast<double>(light->row(i, 0)[k]);
    EXPECT_NEAR(sum, expected, 1e-4 * std::max(expected, 0.01)) << i;
  }
}

TEST(FirstBounce, double_glazing_multiplies_transmittances_and_counts_light_once) {
  Room single = room_with_window_hole(0.5f);
  single.materials.push_back({"window", Rgb(0.0f), Rgb(0.5f), true});
  daylit::testing::add_quad(single, {1.2, 0, 0.9}, {2.8, 0, 0.9}, {2.8, 0, 2.1}, {1.2, 0, 2.1}, 1);
  Room both = single; // a second pane 2 cm outside, joined to the wall by a reveal
  daylit::testing::add_quad(both, {1.2, -0.02, 0.9}, {2.8, -0.02, 0.9}, {2.8, -0.02, 2.1}, {1.2, -0.02, 2.1}, 1);
  add_box(both, {1.2, -0.02, 0.9}, {2.8, 0, 2.1}, 0b110011u, true);
  const auto total = [](const Room& room, double* panes_found = nullptr) {
    const Solved s = prepare(room, 200);
    const auto light = first_bounce(s.set, s.mesh, s.scene, s.apertures, *SkyPartition::uniform(64), kSilent);
    double sum = 0;
    for (std::size_t i = 0; i < s.set.patches.size(); ++i)
      for (std::size_t k = 0; k < light->columns(); ++k)
        sum += s.set.patches[i].area_m2 * static_cast<double>(light->row(i, 0)[k]);
    if (panes_found)
      *panes_found = static_cast<double>(s.apertures.size());
    return sum;
  };
  const double open = total(room_with_window_hole(0.5f));
  EXPECT_NEAR(total(single) / open, 0.5, 1e-3);
  double panes = 0;
  const double ratio = total(both, &panes) / open;
  EXPECT_EQ(panes, 2.0);
  EXPECT_NEAR(ratio, 0.25, 0.01); // the reveal takes and sends back a little
}

TEST(FirstBounce, only_regions_that_the_opening_shows_have_a_column) {
  const Solved s = prepare(room_with_window_hole(0.5f), 300);
  const SkyPartition partition = *SkyPartition::uniform(64);
  const auto light = first_bounce(s.set, s.mesh, s.scene, s.apertures, partition, kSilent);
  ASSERT_TRUE(light);
  EXPECT_LT(light->columns(), 64u);
  for (const std::int32_t region : light->region) // the hole looks south: light travels north, w has y < 0 somewhere
    EXPECT_LT(partition.centre(region).y, 0.35) << region;
}

TEST(Solve, energy_that_enters_is_absorbed_or_leaves) {
  const Solved s = prepare(room_with_window_hole(0.8f), 1200);
  const auto light = first_bounce(s.set, s.mesh, s.scene, s.apertures, *SkyPartition::uniform(64), kSilent);
  SolveReport report;
  const auto b = solve_radiosity(s.set, s.exchange, *light, {}, kSilent, &report);
  ASSERT_TRUE(b);
  EXPECT_LT(report.worst_residual, 2e-5);
  EXPECT_LT(audit_energy(s.set, s.exchange, *light, *b).imbalance, 2e-3);
}

TEST(Solve, factor_and_conjugate_gradients_agree) {
  const Solved s = prepare(coloured_room(), 700);
  const auto light = first_bounce(s.set, s.mesh, s.scene, s.apertures, *SkyPartition::uniform(64), kSilent);
  SolveReport direct, iterated;
  const auto a = solve_radiosity(s.set, s.exchange, *light, {.tolerance = 1e-6, .method = SolveMethod::cholesky},
                                 kSilent, &direct);
  const auto b = solve_radiosity(s.set, s.exchange, *light,
                                 {.tolerance = 1e-6, .method = SolveMethod::conjugate_gradients}, kSilent, &iterated);
  ASSERT_TRUE(a && b);
  EXPECT_EQ(direct.factorised, 3);
  EXPECT_EQ(iterated.factorised, 0);
  EXPECT_LT(direct.worst_residual, 3e-6);
  const float largest = *std::ranges::max_element(a->b);
  for (std::size_t k = 0; k < a->b.size(); ++k)
    ASSERT_NEAR(a->b[k], b->b[k], 3e-6f * largest);
}

TEST(Solve, equal_channels_are_solved_once_and_bit_equal) {
  const Solved grey = prepare(room_with_window_hole(0.5f), 400), coloured = prepare(coloured_room(), 400);
  for (const Solved* s : {&grey, &coloured}) {
    const auto light = first_bounce(s->set, s->mesh, s->scene, s->apertures, *SkyPartition::uniform(16), kSilent);
    SolveReport report;
    const auto b = solve_radiosity(s->set, s->exchange, *light, {}, kSilent, &report);
    ASSERT_TRUE(b);
    EXPECT_EQ(report.channels, s == &grey ? 1 : 3);
    EXPECT_EQ(report.residual.size(), static_cast<std::size_t>(report.channels) * light->columns());
    const bool equal = std::equal(b->row(7), b->row(7) + light->columns(), b->row(7) + light->columns());
    EXPECT_EQ(equal, s == &grey);
  }
}

} // namespace
} // namespace daylit::radiosity
