#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <numbers>
#include <numeric>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "radiosity/detail/block_visibility.h"
#include "radiosity/detail/sampling.h"
#include "radiosity/first_bounce.h"
#include "radiosity/form_factors.h"
#include "radiosity/gather.h"
#include "radiosity/patches.h"
#include "radiosity/polygon_kernel.h"
#include "radiosity/solve.h"
#include "scene/sky_partition.h"
#include "sh/band4.h"
#include "sh/sh9.h"
#include "tests/radiosity/rooms.h"

namespace daylit::radiosity {
namespace {

using testing::add_box;
using testing::grey_room;
using testing::room_with_window_hole;
constexpr double kPi = std::numbers::pi;
const Progress kSilent = [](const std::string&, double) { return true; };

/// Everything up to the exchange matrix.
struct Solved {
  Room room;
  PatchMesh mesh;
  RayScene scene;
  std::vector<Aperture> apertures;
  ElementSet set;
  ExchangeMatrix exchange;
  std::vector<float> dense; ///< the same, [element][element]

  const float* row(std::size_t i) const { return dense.data() + i * set.elements.size(); }
};

Solved prepare(const Room& room, int patches, const std::vector<Aperture>& seeds = {},
               const ExchangeOptions& options = {}) {
  Solved s;
  s.room = room;
  s.mesh = *mesh_patches(room, {.target_patches = patches});
  s.scene = *patch_scene(s.mesh);
  s.apertures = seeds;
  if (seeds.empty()) {
    const auto found = find_apertures(room, *RayScene::build(room));
    EXPECT_TRUE(found) << found.error().message();
    s.apertures = found->list;
  }
  s.set = find_elements(room, s.mesh, s.scene, s.apertures);
  s.exchange = *exchange_areas(s.set, s.mesh, room, *RayScene::build(room), options, kSilent);
  s.dense = s.exchange.dense();
  return s;
}

/// A point in the middle of a closed room, where the search for lit sides starts.
std::vector<Aperture> seed_at(const glm::dvec3& p) {
  return {{.corners = {p, p + glm::dvec3(1e-3, 0, 0), p + glm::dvec3(0, 1e-3, 0)}, .inward = {0, 0, 1}}};
}

FirstBounce emission(const Solved& s, float value) {
  FirstBounce f;
  f.elements = s.set.elements.size();
  f.region = {0};
  f.irradiance.assign(f.elements * 3, value);
  f.opening.assign(f.elements, 0.0f);
  return f;
}

double row_sum(const Solved& s, std::size_t i) {
  return std::accumulate(s.row(i), s.row(i) + s.set.elements.size(), 0.0) / s.set.elements[i].area_m2;
}

TEST(FormFactors, rows_of_a_closed_convex_room_sum_to_one) {
  Room room = grey_room(0.5f);
  add_box(room, {0, 0, 0}, {4, 3, 2.5}, 0b111111u, true);
  const Solved s = prepare(room, 800, seed_at({2, 1.5, 1}));
  double worst = 0;
  for (std::size_t i = 0; i < s.set.elements.size(); ++i)
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
  for (std::size_t i = 0; i < s.set.elements.size(); ++i) {
    const double a = s.set.elements[i].area_m2, c = row_sum(s, i) + static_cast<double>(light->opening[i]) - 1.0;
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
  for (std::size_t i = 0; i < one.set.elements.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      ASSERT_EQ(one.row(i)[j], one.row(j)[i]);
}

TEST(Elements, both_sides_of_a_free_standing_panel_and_no_outside_of_a_wall_are_unknowns) {
  Room room = room_with_window_hole(0.5f);
  testing::add_quad(room, {1, 3, 0}, {3, 3, 0}, {3, 3, 1.5}, {1, 3, 1.5});
  const Solved s = prepare(room, 600);
  double panel = 0, walls = 0;
  for (const Element& e : s.set.elements) {
    const glm::dvec3 m = (e.corner[0] + e.corner[1] + e.corner[2]) / 3.0 + s.mesh.origin;
    (std::abs(m.y - 3) < 1e-9 && m.x > 1 && m.x < 3 && m.z < 1.5 ? panel : walls) += e.area_m2;
  }
  EXPECT_NEAR(panel, 2 * 3.0, 1e-6); // both its sides
  EXPECT_NEAR(walls, 2 * (4 * 5 + 4 * 2.8 + 5 * 2.8) - 1.6 * 1.2, 1e-6);
}

TEST(Elements, floor_under_furniture_and_the_inside_of_furniture_are_dark) {
  Room room = room_with_window_hole(0.5f);
  add_box(room, {1, 1, 0}, {2, 2, 0.8}, 0b111110u, false);
  const Solved s = prepare(room, 800);
  double area = 0;
  for (const Element& e : s.set.elements)
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
    for (std::size_t i = 0; i < s.set.elements.size(); ++i)
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
      static_cast<float>(10000.0 / s.set.elements[5].area_m2); // 10,000 lm on one patch
  const auto b = solve_radiosity(s.set, s.exchange, light, {}, kSilent);
  ASSERT_TRUE(b);
  double flux = 0;
  for (std::size_t i = 0; i < s.set.elements.size(); ++i)
    flux += s.set.elements[i].area_m2 * static_cast<double>(b->row(i)[0]) / 0.7;
  EXPECT_NEAR(flux / 96.0 / (10000.0 / (96.0 * 0.3)), 1.0, 2e-3); // 347.222 lx in total
}

TEST(FirstBounce, uniform_sky_through_a_hole_is_pi_times_the_form_factor) {
  const Solved s = prepare(room_with_window_hole(0.5f), 500);
  const auto light = first_bounce(s.set, s.mesh, s.scene, s.apertures, *SkyPartition::uniform(64), kSilent);
  ASSERT_TRUE(light);
  const std::array<glm::dvec3, 4> hole = {glm::dvec3(1.2, 0, 0.9), {1.2, 0, 2.1}, {2.8, 0, 2.1}, {2.8, 0, 0.9}};
  for (std::size_t i = 0; i < s.set.elements.size(); i += 7) {
    const Element& e = s.set.elements[i];
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
  testing::add_quad(single, {1.2, 0, 0.9}, {2.8, 0, 0.9}, {2.8, 0, 2.1}, {1.2, 0, 2.1}, 1);
  Room both = single; // a second pane 2 cm outside, joined to the wall by a reveal
  testing::add_quad(both, {1.2, -0.02, 0.9}, {2.8, -0.02, 0.9}, {2.8, -0.02, 2.1}, {1.2, -0.02, 2.1}, 1);
  add_box(both, {1.2, -0.02, 0.9}, {2.8, 0, 2.1}, 0b110011u, true);
  const auto total = [](const Room& room, double* panes_found = nullptr) {
    const Solved s = prepare(room, 200);
    const auto light = first_bounce(s.set, s.mesh, s.scene, s.apertures, *SkyPartition::uniform(64), kSilent);
    double sum = 0;
    for (std::size_t i = 0; i < s.set.elements.size(); ++i)
      for (std::size_t k = 0; k < light->columns(); ++k)
        sum += s.set.elements[i].area_m2 * static_cast<double>(light->row(i, 0)[k]);
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

TEST(Gather, constant_radiance_has_only_the_zeroth_coefficient) {
  Room room = grey_room(0.5f);
  add_box(room, {0, 0, 0}, {4, 3, 2.5}, 0b111111u, true);
  const Solved s = prepare(room, 300, seed_at({2, 1.5, 1}));
  Radiosity b{s.set.elements.size(), 3,
              std::vector<float>(s.set.elements.size() * 3, static_cast<float>(kPi))}; // L = 1
  const std::array<glm::dvec3, 2> points = {glm::dvec3(0, 0, 0), glm::dvec3(1.2, -0.7, 0.4)};
  const auto c = gather_coefficients(*gather_hits(points, s.set, s.mesh, s.scene, {}, kSilent), b, kSilent);
  ASSERT_TRUE(c);
  for (std::size_t p = 0; p < 2; ++p)
    for (std::size_t l = 0; l < 9; ++l)
      EXPECT_NEAR((*c)[(p * 9 + l) * 3], l == 0 ? std::sqrt(4 * kPi) : 0.0, 5e-3) << l;
}

TEST(Gather, weights_are_those_of_the_rays_one_by_one) {
  const Solved s = prepare(room_with_window_hole(0.5f), 300);
  const std::array<glm::dvec3, 3> points = {glm::dvec3(0, 0, 0.3), glm::dvec3(1.2, -0.7, 0.4),
                                            glm::dvec3(-0.9, 0.8, -0.2)};
  const int rays = 1000; // no multiple of a packet
  const RayFan fan = RayFan::of(rays);
  const auto hits = gather_hits(points, s.set, s.mesh, s.scene, {.rays = rays}, kSilent, 2 * rays); // one again
  ASSERT_TRUE(hits);
  const std::size_t n = s.set.elements.size();
  for (std::size_t number = 0; number < 2 * points.size(); ++number) {
    const std::size_t p = number / 2;
    const Bands bands = number % 2 == 0 ? Bands::low : Bands::fourth;
    const double angle = 2 * kPi * random_shift(p).y;
    const auto c = float(std::cos(angle)), t = float(std::sin(angle));
    std::vector<float> expected(9 * n, 0.0f), weights(9 * n);
    for (const glm::vec3& d : fan.direction) {
      const glm::vec3 ray(d.x * c - d.y * t, d.x * t + d.y * c, d.z); // turned about z
      RayHit hit;
      if (!s.scene.closest(s.scene.to_local(points[p]), ray, 0, 1e9f, hit))
        continue;
      if (const std::int32_t met = s.set.hit(s.mesh, hit.triangle, ray); met >= 0)
        for (std::size_t l = 0; l < 9; ++l)
          expected[l * n + static_cast<std::size_t>(met)] +=
              float(4.0 / rays) * (bands == Bands::low ? sh::evaluate9(ray) : sh::evaluate_band4(ray))[l];
    }
    hits->weights(p, weights.data(), bands);
    int other = 0; // a ray along an edge may fall to either side
    for (std::size_t e = 0; e < n; ++e) {
      if (std::abs(weights[e] - expected[e]) > 1e-6f && ++other)
        continue;
      for (std::size_t l = 0; l < 9; ++l)
        ASSERT_NEAR(weights[l * n + e], expected[l * n + e], 1e-6f) << "point " << p << " element " << e;
    }
    EXPECT_LE(other, 2);
  }
}

TEST(Gather, irradiance_to_order_four_is_closer_to_the_cosine_sum_over_the_rays) {
  const Solved s = prepare(room_with_window_hole(0.5f), 300);
  const std::size_t n = s.set.elements.size();
  Radiosity b{n, 3, std::vector<float>(n * 3, 0.01f)};
  for (std::size_t e = 0; e < n; e += 40) // bright patches
    std::fill_n(b.b.begin() + static_cast<std::ptrdiff_t>(3 * e), 3, 10.0f);
  const std::array<glm::dvec3, 3> points = {glm::dvec3(0, 0, 0.3), glm::dvec3(1.2, -0.7, 0.4),
                                            glm::dvec3(-0.9, 0.8, -0.2)};
  const auto hits = gather_hits(points, s.set, s.mesh, s.scene, {.rays = 4096}, kSilent);
  ASSERT_TRUE(hits);
  const auto low = gather_coefficients(*hits, b, kSilent),
             fourth = gather_coefficients(*hits, b, kSilent, Bands::fourth);
  ASSERT_TRUE(low && fourth);
  const RayFan fan = RayFan::of(4096);
  double nine = 0, all = 0;
  for (std::size_t p = 0; p < points.size(); ++p) {
    const double angle = 2 * kPi * random_shift(p).y;
    const auto c = float(std::cos(angle)), t = float(std::sin(angle));
    std::vector<std::pair<glm::vec3, double>> seen; // radiosity by direction
    for (const glm::vec3& d : fan.direction) {
      const glm::vec3 ray(d.x * c - d.y * t, d.x * t + d.y * c, d.z);
      RayHit hit;
      if (!s.scene.closest(s.scene.to_local(points[p]), ray, 0, 1e9f, hit))
        continue;
      if (const std::int32_t met = s.set.hit(s.mesh, hit.triangle, ray); met >= 0)
        seen.emplace_back(ray, b.b[3 * std::size_t(met)]);
    }
    for (const glm::vec3& normal : RayFan::of(100).direction) {
      double exact = 0, e2 = 0, e4 = 0;
      for (const auto& [ray, radiosity] : seen)
        exact += std::max(0.0, double(glm::dot(ray, normal))) * radiosity * 4.0 / 4096;
      const auto y = sh::evaluate9(normal), y4 = sh::evaluate_band4(normal);
      for (std::size_t l = 0; l < 9; ++l) {
        e2 += double(sh::kClampedCosine9<float>[l] * y[l] * (*low)[(p * 9 + l) * 3]);
        e4 += sh::kClampedCosineBand4<double> * double(y4[l] * (*fourth)[(p * 9 + l) * 3]);
      }
      nine += (e2 - exact) * (e2 - exact);
      all += (e2 + e4 - exact) * (e2 + e4 - exact);
    }
  }
  EXPECT_LT(std::sqrt(all), 0.6 * std::sqrt(nine));
}

Room coloured_room() {
  Room room = room_with_window_hole(0.5f);
  room.materials[0].reflectance = Rgb(0.8f, 0.5f, 0.2f);
  add_box(room, {1, 1, 0}, {2, 2, 0.8}, 0b111110u, false);
  return room;
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

TEST(Adjoint, volume_to_light_equals_light_to_volume) {
  const Solved s = prepare(coloured_room(), 500);
  const auto light = first_bounce(s.set, s.mesh, s.scene, s.apertures, *SkyPartition::uniform(64), kSilent);
  const auto b = solve_radiosity(s.set, s.exchange, *light, {.tolerance = 1e-6}, kSilent);
  ASSERT_TRUE(b);
  const std::array<glm::dvec3, 2> points = {glm::dvec3(0, 0, 0.3), glm::dvec3(1.2, -0.7, 0.4)};
  const GatherHits hits = *gather_hits(points, s.set, s.mesh, s.scene, {}, kSilent);
  const auto forward = gather_coefficients(hits, *b, kSilent);
  SolveReport report;
  const auto adjoint = adjoint_coefficients(hits, s.set, s.exchange, *light, {.tolerance = 1e-6}, kSilent, &report);
  ASSERT_TRUE(forward && adjoint);
  ASSERT_EQ(forward->size(), adjoint->size());
  EXPECT_EQ(report.channels, 3);
  float largest = 0;
  for (const float x : *forward)
    largest = std::max(largest, std::abs(x));
  for (std::size_t k = 0; k < forward->size(); ++k)
    ASSERT_NEAR((*forward)[k], (*adjoint)[k], 2e-6f * largest) << k;
}

TEST(Gather, rays_that_are_not_kept_are_traced_again_to_the_same_bits) {
  const Solved s = prepare(coloured_room(), 300);
  const std::array<glm::dvec3, 3> points = {glm::dvec3(0, 0, 0.3), glm::dvec3(1.2, -0.7, 0.4), glm::dvec3(0.5, 1, 1)};
  std::vector<float> kept(9 * s.set.elements.size()), again(kept.size());
  const GatherHits all = *gather_hits(points, s.set, s.mesh, s.scene, {}, kSilent);
  for (const std::size_t most : {std::size_t{0}, std::size_t{1024}, std::size_t{2100}}) {
    const GatherHits some = *gather_hits(points, s.set, s.mesh, s.scene, {}, kSilent, most);
    ASSERT_EQ(some.points(), 3u);
    for (std::size_t p = 0; p < 3; ++p) {
      all.weights(p, kept.data());
      some.weights(p, again.data());
      ASSERT_EQ(kept, again) << most << " " << p;
    }
  }
}

TEST(Gather, tracing_says_how_far_it_is_and_can_be_stopped) {
  const Solved s = prepare(coloured_room(), 300);
  const std::vector<glm::dvec3> points(256, glm::dvec3(0.2, 0.1, 0.4));
  std::atomic<double> last{0};
  ASSERT_TRUE(gather_hits(points, s.set, s.mesh, s.scene, {.rays = 16}, [&](const std::string&, double share) {
    last = std::max(last.load(), share);
    return true;
  }));
  EXPECT_EQ(last, 1.0);
  EXPECT_FALSE(
      gather_hits(points, s.set, s.mesh, s.scene, {.rays = 16}, [](const std::string&, double) { return false; }));
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
