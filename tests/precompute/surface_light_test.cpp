// Further bounces solved for clusters of patches: what they bring to the probes.

#include <cmath>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "bench/room_parts.h"
#include "precompute/detail/surface_transport.h"
#include "precompute/detail/transport_problem.h"
#include "precompute/surface_light.h"

namespace daylit::precompute {
namespace {

const Progress kQuiet = [](const std::string&, double) { return true; };

/// Number `index` of a sequence in 0..1.
float number(std::uint64_t index) {
  return static_cast<float>(static_cast<double>(radiosity::mix_bits(index) >> 11) * 0x1p-53);
}

std::vector<float> numbers(std::uint64_t seed, std::size_t count) {
  std::vector<float> list;
  for (std::size_t k = 0; k < count; ++k)
    list.push_back(number(1000 * seed + k));
  return list;
}

double product(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k)
    sum += static_cast<double>(a[k]) * static_cast<double>(b[k]);
  return sum;
}

constexpr float kReflectance = 0.7f;

/// A grey room, all of whose elements are lit: its patches, where no other count is asked for.
struct Lit {
  Room room;
  detail::Problem problem;
  detail::LightElements elements;
  radiosity::ExchangeMatrix exchange;

  explicit Lit(std::size_t count = 0, Room lit_room = bench::room_with_window_hole(kReflectance))
      : room(std::move(lit_room)) {
    BakeOptions options;
    options.target_facets = 300;
    options.spacing_m = 1.0;
    BakeReport report;
    detail::StageClock clock(report);
    problem = *detail::set_up(room, options, report, clock);
    elements = *detail::LightElements::make(problem.mesh, problem.patches, problem.apertures.list, problem.room_scene,
                                            problem.field, count);
    exchange = *radiosity::exchange_areas(problem.patches, problem.mesh, room, problem.room_scene, {}, kQuiet);
  }
  std::size_t patches() const { return problem.patches.patches.size(); }

  /// h with sum w_i B_i = sum h_i E_i.
  std::vector<float> adjoint(const std::vector<float>& w) const {
    return *radiosity::solve_adjoint(problem.patches, exchange, w, 1, 0, {.tolerance = 1e-7}, kQuiet);
  }

  SurfaceLight in_clusters(const ProbeSight& probes, std::size_t clusters) const {
    std::vector<radiosity::FirstBounceRow> rows(elements.parent.size());
    for (radiosity::FirstBounceRow& row : rows) {
      row.region = {0};
      row.irradiance = {Rgb(1.0f)};
    }
    SurfaceLightReport report;
    return *surface_light(problem.patches, elements, exchange, std::move(rows), probes, clusters, {.tolerance = 1e-7},
                          kQuiet, report);
  }
};

TEST(SurfaceLight, clusters_bring_each_group_of_probes_and_all_together_exactly_the_light_of_their_patches) {
  const Lit lit;
  // What the probes of each group see: the first one none of the first half of the patches.
  std::vector<std::vector<float>> w{numbers(1, lit.patches()), numbers(5, lit.patches())}, h;
  std::fill_n(w[0].begin(), lit.patches() / 2, 0.0f);
  ProbeSight probes{std::vector<std::uint8_t>(lit.patches(), 1), {}};
  for (const std::vector<float>& of_group : w) {
    h.push_back(lit.adjoint(of_group));
    for (std::size_t p = 0; p < lit.patches(); ++p) // h = A r + w reflectance: what is reflected once comes by itself
      probes.further.push_back((h.back()[p] - of_group[p] * kReflectance) /
                               static_cast<float>(lit.problem.patches.patches[p].area_m2));
  }
  const SurfaceLight light = lit.in_clusters(probes, 6);
  ASSERT_EQ(light.clusters, 6u);
  const detail::SurfaceTransport transport(light);
  for (const std::uint64_t seed : {2, 3, 4}) {
    const std::vector<float> e = numbers(seed, lit.patches()), b = transport.radiosity(0, e, 1);
    // An area mean in each cluster is off by 1e-4 to 1e-3 here.
    EXPECT_NEAR((product(w[0], b) + product(w[1], b)) / (product(h[0], e) + product(h[1], e)), 1.0, 2e-5);
    for (std::size_t g = 0; g < 2; ++g) {
      const auto seen =
          detail::SeenParts::of(light, light.fraction_for(g), std::vector<Sight>(lit.patches(), Sight::of_patch));
      std::vector<float> weights(lit.patches(), 0.0f);
      transport.add_adjoint(0, w[g], 1, seen, weights);
      EXPECT_NEAR(product(weights, e) / product(h[g], e), 1.0, 2e-5) << g;
    }
  }
}

TEST(SurfaceLight, a_room_that_sends_nothing_to_any_probe_has_clusters_with_means) {
  const Lit lit;
  const ProbeSight nothing{std::vector<std::uint8_t>(lit.patches(), 1), std::vector<float>(lit.patches(), 0.0f)};
  const SurfaceLight light = lit.in_clusters(nothing, 6);
  std::vector<double> sum(light.clusters, 0.0);
  for (std::size_t s = 0; s < light.source.size(); ++s)
    sum[light.cluster[s]] += static_cast<double>(light.cluster_fraction[s]);
  for (const double of_cluster : sum)
    EXPECT_NEAR(of_cluster, 1.0, 1e-5);
}

/// With a ball of 20 triangles, 10 cm wide, in the middle.
Room with_ball() {
  Room room = bench::room_with_window_hole(kReflectance);
  bench::add_sphere(room, {2.0, 2.5, 1.2}, 0.05, 1);
  return room;
}

TEST(SurfaceLight, the_walls_have_as_many_clusters_as_without_small_furniture) {
  const Lit lit(0, with_ball());
  const ProbeSight probes{std::vector<std::uint8_t>(lit.patches(), 1), std::vector<float>(lit.patches(), 1.0f)};
  const SurfaceLight light = lit.in_clusters(probes, 60);
  std::set<std::uint32_t> of_walls;
  std::size_t of_ball = 0;
  for (std::size_t s = 0; s < light.source.size(); ++s)
    if (lit.problem.patches.patches[light.parent[light.source[s]]].area_m2 < 0.005)
      ++of_ball;
    else
      of_walls.insert(light.cluster[s]);
  EXPECT_GE(of_ball, 20u);
  EXPECT_GE(of_walls.size(), 55u);
}

/// w . b(E) = w_E . E, where each element counts by itself.
TEST(SurfaceTransport, weights_of_radiosity_become_those_of_irradiance) {
  const Lit lit(1200);
  const std::size_t count = lit.elements.parent.size();
  const ProbeSight probes{std::vector<std::uint8_t>(lit.patches(), 1), std::vector<float>(lit.patches(), 1.0f)};
  const SurfaceLight light = lit.in_clusters(probes, 40);
  ASSERT_EQ(light.source.size(), count);
  const detail::SurfaceTransport transport(light);
  const auto seen =
      detail::SeenParts::of(light, light.cluster_fraction, std::vector<Sight>(lit.patches(), Sight::of_elements));
  ASSERT_EQ(seen.lit.size(), count);
  const std::vector<float> w = numbers(1, count), e = numbers(2, count);
  std::vector<float> weights(count, 0.0f);
  transport.add_adjoint(0, w, 1, seen, weights);
  const double expected = product(w, transport.radiosity(0, e, 1));
  EXPECT_NEAR(product(weights, e) / expected, 1.0, 1e-5);
  SurfaceLight flat = light;
  flat.further = {};
  EXPECT_GT(std::abs(product(w, detail::SurfaceTransport(flat).radiosity(0, e, 1)) / expected - 1.0), 1e-5)
      << "the light within the patches counts";
}

} // namespace
} // namespace daylit::precompute
