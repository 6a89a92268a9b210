// The pieces under the exchange matrix, each against a slow twin.

#include <algorithm>
#include <cmath>
#include <random>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "radiosity/detail/block_visibility.h"
#include "radiosity/detail/exchange_tile.h"
#include "radiosity/detail/low_rank.h"
#include "radiosity/detail/pair_shadow.h"
#include "radiosity/energy.h"
#include "radiosity/first_bounce.h"
#include "radiosity/form_factors.h"
#include "radiosity/polygon_kernel.h"
#include "radiosity/solve.h"
#include "radiosity/surface_mesh.h"
#include "scene/sky/sky_partition.h"
#include "tests/radiosity/dense_matrix.h"
#include "tests/radiosity/rooms.h"

namespace daylit::radiosity {
namespace {

using testing::add_box;
using testing::room_with_window_hole;
const Progress kSilent = [](const std::string&, double) { return true; };

/// A furnished room up to the unknowns and their tree.
struct Furnished {
  Room room;
  SurfaceMesh mesh;
  RayScene scene, rays;
  std::vector<Aperture> apertures;
  PatchSet set;
  std::vector<ClusterItem> items;

  explicit Furnished(int facets, bool turned = false, int sphere = 0) : room(room_with_window_hole(0.5f)) {
    if (sphere > 0)
      testing::add_sphere(room, {1.4, 3.4, 1.5}, 0.6, sphere);
    add_box(room, {1, 1, 0}, {2, 2, 0.8}, 0b111110u, false);
    add_box(room, {2.6, 2.5, 0}, {3.1, 3.4, 1.7}, 0b111110u, false);
    if (turned) // 30 degrees about z: no face but floor and ceiling is aligned with an axis
      for (glm::dvec3& v : room.vertices)
        v = {v.x * std::sqrt(0.75) - v.y * 0.5, v.x * 0.5 + v.y * std::sqrt(0.75), v.z};
    mesh = *mesh_surfaces(room, {.target_facets = facets});
    scene = *facet_scene(mesh);
    rays = *RayScene::build(room);
    apertures = find_apertures(room, rays)->list;
    set = find_patches(room, mesh, scene, apertures);
    for (const Patch& e : set.patches) {
      const Facet& p = mesh.facets[e.facet];
      items.push_back({e.corner, e.normal, 2 * p.plane + (glm::dot(e.normal, p.normal) < 0.0 ? 1u : 0u)});
    }
  }
  /// Segment between random points of two patches meets a surface.
  bool blocked(const Patch& a, const Patch& b, std::mt19937& random) const {
    const auto on = [&](const Patch& e) {
      std::uniform_real_distribution<double> unit(0.01, 0.99);
      double u = unit(random), v = unit(random);
      if (u + v > 1) {
        u = 1 - u;
        v = 1 - v;
      }
      return e.corner[0] + u * (e.corner[1] - e.corner[0]) + v * (e.corner[2] - e.corner[0]);
    };
    const glm::dvec3 p = on(a), q = on(b);
    return scene.occluded(scene.to_local(p), glm::vec3(q - p), 1e-4f, 1.0f - 1e-4f);
  }
};

bool face(const Patch& a, const Patch& b) {
  for (const glm::dvec3& p : a.corner)
    for (const glm::dvec3& q : b.corner)
      if (glm::dot(q - p, a.normal) <= 1e-3 || glm::dot(p - q, b.normal) <= 1e-3)
        return false;
  return true;
}

TEST(ClusterTree, every_item_is_in_one_leaf_and_inside_its_clusters) {
  const Furnished f(600);
  const ClusterTree tree(f.items, 16);
  std::vector<int> seen(f.items.size(), 0);
  std::size_t flat = 0, leaves = 0;
  for (const Cluster& c : tree.clusters()) {
    for (std::uint32_t k = c.first; k < c.last; ++k)
      for (const glm::dvec3& p : f.items[tree.order()[k]].corner)
        for (int axis = 0; axis < 3; ++axis) {
          ASSERT_GE(p[axis], c.box.lo[axis]);
          ASSERT_LE(p[axis], c.box.hi[axis]);
        }
    if (!c.childless())
      continue;
    ++leaves;
    flat += c.plane >= 0;
    EXPECT_LE(c.size(), 16u);
    for (std::uint32_t k = c.first; k < c.last; ++k)
      ++seen[tree.order()[k]];
  }
  EXPECT_EQ(std::ranges::count(seen, 1), static_cast<std::ptrdiff_t>(seen.size()));
  EXPECT_GT(flat, leaves * 9 / 10); // planes come apart
}

TEST(Obstacles, triangles_of_a_rectangle_become_one_and_area_is_kept) {
  const Furnished f(200);
  const auto obstacles = convex_obstacles(f.room, f.mesh.origin);
  double area = 0, expected = 0;
  for (const Obstacle& o : obstacles) {
    glm::dvec3 sum(0.0);
    for (std::size_t k = 1; k + 1 < o.corner.size(); ++k)
      sum += glm::cross(o.corner[k] - o.corner[0], o.corner[k + 1] - o.corner[0]);
    EXPECT_GT(glm::dot(sum, o.normal), 0.0);
    area += 0.5 * glm::length(sum);
  }
  for (const RoomTriangle& t : f.room.triangles)
    expected += area_m2(f.room, t);
  EXPECT_NEAR(area, expected, 1e-9);
  EXPECT_LE(obstacles.size(), f.room.triangles.size() / 2);
}

TEST(BlockVisibility, clear_and_hidden_clusters_agree_with_rays) {
  for (const int kind : {0, 1, 2}) {
    const Furnished f(1300, kind == 1, kind == 2 ? 4 : 0);
    const ClusterTree tree(f.items, 8);
    const BlockVisibility visibility(convex_obstacles(f.room, f.mesh.origin));
    std::mt19937 random(1);
    std::size_t clear = 0, hidden = 0, all = 0;
    for (const Cluster& a : tree.clusters())
      for (const Cluster& b : tree.clusters()) {
        if (!a.childless() || !b.childless() || &a >= &b)
          continue;
        const Visibility seen = visibility.between_clusters(tree, a, b);
        ++all;
        clear += seen == Visibility::clear;
        hidden += seen == Visibility::hidden;
        for (std::uint32_t i = a.first; i < a.last && seen != Visibility::mixed; ++i)
          for (std::uint32_t j = b.first; j < b.last; j += 3) {
            const Patch &p = f.set.patches[tree.order()[i]], &q = f.set.patches[tree.order()[j]];
            if (face(p, q)) {
              ASSERT_EQ(f.blocked(p, q, random), seen == Visibility::hidden) << i << ' ' << j;
            }
          }
      }
    EXPECT_GT(clear, all / 3);
    EXPECT_GT(hidden, 10u);
  }
}

TEST(BlockVisibility, two_boards_a_millimetre_apart_do_not_hide_their_own_outer_faces) {
  Room room = room_with_window_hole(0.5f);
  for (const double x : {1.9, 1.901})
    testing::add_quad(room, {x, 3.0, 0.3}, {x, 4.5, 0.3}, {x, 4.5, 1.8}, {x, 3.0, 1.8});
  const auto mesh = mesh_surfaces(room, {.target_facets = 1500});
  const auto scene = facet_scene(*mesh);
  const auto rays = RayScene::build(room);
  const auto apertures = find_apertures(room, *rays)->list;
  const PatchSet set = find_patches(room, *mesh, *scene, apertures);
  const auto exchange = exchange_areas(set, *mesh, room, *rays, {}, kSilent);
  const auto light = first_bounce(set, *mesh, *scene, apertures, *SkyPartition::uniform(16), kSilent);
  ASSERT_TRUE(exchange && light);
  const auto sums = exchange->row_sums();
  for (std::size_t i = 0; i < sums.size(); ++i)
    EXPECT_NEAR(sums[i] / set.patches[i].area_m2 + static_cast<double>(light->opening[i]), 1.0, 3e-3) << i;
}

TEST(BlockVisibility, facets_of_a_sphere_hide_nothing_from_one_another) {
  const Furnished f(400, false, 8); // 1,280 facets, each a plane of its own
  const ClusterTree tree(f.items, 32);
  const BlockVisibility visibility(convex_obstacles(f.room, f.mesh.origin));
  std::size_t curved_clear = 0, front = 0, behind = 0;
  for (const Cluster& a : tree.clusters())
    for (const Cluster& b : tree.clusters()) {
      if (a.plane >= 0 || !a.childless() || !b.childless() || &a == &b)
        continue;
      const bool all_front = visibility.in_front(tree, a, b), all_behind = visibility.behind(tree, a, b);
      front += all_front;
      behind += all_behind;
      curved_clear += b.childless() && visibility.between_clusters(tree, a, b) == Visibility::clear;
      for (std::uint32_t i = a.first; i < a.last; i += 5)
        for (std::uint32_t j = b.first; j < b.last; j += 7) {
          const Patch &p = f.set.patches[tree.order()[i]], &q = f.set.patches[tree.order()[j]];
          for (const glm::dvec3& c : q.corner) {
            const double height = glm::dot(c - p.corner[0], p.normal);
            ASSERT_TRUE((!all_front || height > -1e-5) && (!all_behind || height < 1e-5)) << i << ' ' << j;
          }
        }
    }
  std::printf("%zu clear, %zu in front, %zu behind\n", curved_clear, front, behind);
  EXPECT_GT(curved_clear, 1000u);
  EXPECT_GT(front, 20u);
  EXPECT_GT(behind, 1000u);
  // Of the pairs that face each other most are decided without a ray, though 1,300 faces may stand between.
  ExchangeReport report;
  const auto m = exchange_areas(f.set, f.mesh, f.room, f.rays, {}, kSilent, &report);
  ASSERT_TRUE(m);
  std::printf("pairs: %zu facing, %zu clear, %zu low rank, %zu by rays\n", std::size_t{report.facing_pairs},
              std::size_t{report.clear_pairs}, std::size_t{report.low_rank_pairs}, std::size_t{report.sampled_pairs});
  EXPECT_GT(report.clear_pairs, report.facing_pairs * 3 / 5);
  const auto light = first_bounce(f.set, f.mesh, f.scene, f.apertures, *SkyPartition::uniform(64), kSilent);
  const auto sums = m->row_sums();
  double square = 0, worst = 0; // the worst row is up to 1.2e-3 off on meshes of 400, 600, 800 and 1,000 facets
  for (std::size_t i = 0; i < sums.size(); ++i) {
    const double off = sums[i] / f.set.patches[i].area_m2 + static_cast<double>(light->opening[i]) - 1.0;
    square += off * off / static_cast<double>(sums.size());
    worst = std::max(worst, std::abs(off));
  }
  std::printf("rows off by %.2g rms, %.2g at worst\n", std::sqrt(square), worst);
  EXPECT_LT(std::sqrt(square), 2e-4);
  EXPECT_LT(worst, 1.5e-3);
}

TEST(PairShadow, clear_and_hidden_pairs_agree_with_rays) {
  for (const bool turned : {false, true}) {
    const Furnished f(1000, turned);
    const BlockVisibility visibility(convex_obstacles(f.room, f.mesh.origin));
    const ClusterTree tree(f.items, 16);
    const glm::dvec3 shift = f.mesh.origin - f.rays.origin();
    const PairArrays arrays(f.set, tree.order(), shift);
    std::array<std::size_t, 3> count{};
    std::mt19937 random(2);
    for (const Cluster& a : tree.clusters())
      for (const Cluster& b : tree.clusters()) {
        if (!a.childless() || !b.childless())
          continue;
        const auto between = visibility.between(tree, a, b, 100);
        PairShadows shadows(arrays, visibility.obstacles(), between.items, shift, b.first, b.last, 2e-5f);
        std::vector<std::int32_t> shadow(b.size());
        for (std::uint32_t i = a.first; i < a.last; i += 3) {
          shadows.row(i, shadow.data());
          for (std::uint32_t j = b.first; j < b.last; ++j) {
            const Patch &p = f.set.patches[tree.order()[i]], &q = f.set.patches[tree.order()[j]];
            const std::int32_t s = shadow[j - b.first];
            if (i == j || !face(p, q))
              continue;
            ++count[static_cast<std::size_t>(s)];
            if (s != kMixedPair) {
              ASSERT_EQ(f.blocked(p, q, random), s == kHiddenPair) << i << ' ' << j;
            }
          }
        }
      }
    EXPECT_GT(count[kClearPair], 2 * count[kMixedPair]);
    EXPECT_GT(count[kHiddenPair], count[kMixedPair] / 20);
  }
}

TEST(PairKernel, nine_points_follow_the_contour_integral_where_they_are_trusted) {
  const Furnished f(900);
  const ClusterTree tree(f.items, 16);
  const PairArrays arrays(f.set, tree.order(), glm::dvec3(0.0));
  const auto n = static_cast<std::uint32_t>(f.items.size());
  std::vector<float> exchange(n);
  std::vector<std::int32_t> state(n);
  std::size_t far = 0;
  double squares = 0;
  for (std::uint32_t i = 0; i < n; i += 11) {
    pair_row(arrays, i, 0, n, exchange.data(), state.data());
    const Patch& p = f.set.patches[tree.order()[i]];
    for (std::uint32_t j = 0; j < n; ++j) {
      const Patch& q = f.set.patches[tree.order()[j]];
      const double exact = i == j ? 0.0 : exchange_area_unoccluded(p.corner, p.normal, q.corner, q.normal);
      if (state[j] == kNotFacing) {
        ASSERT_LT(exact, 1e-6 * p.area_m2) << i << ' ' << j;
      }
      if (state[j] != kFar || !face(p, q))
        continue;
      ++far;
      const double error = static_cast<double>(exchange[j]) / exact - 1.0;
      ASSERT_LT(std::abs(error), 2e-3) << i << ' ' << j;
      squares += error * error;
    }
  }
  EXPECT_GT(far, n);
  EXPECT_LT(std::sqrt(squares / static_cast<double>(far)), 1.4e-4); // measured 1.1e-4, the largest error 1.6e-3
}

TEST(LowRank, cross_approximation_is_within_its_tolerance_of_the_kernel) {
  const Furnished f(3000);
  const ClusterTree tree(f.items, 32);
  const PairArrays arrays(f.set, tree.order(), glm::dvec3(0.0));
  const BlockVisibility visibility(convex_obstacles(f.room, f.mesh.origin));
  const ExchangePlan plan = plan_exchange(tree, visibility, {});
  std::size_t checked = 0;
  for (const PlanBlock& b : plan.blocks) {
    if (!b.low_rank || ++checked % 7 != 0)
      continue;
    const Cluster &rows = tree[b.a], &columns = tree[b.b];
    const auto product = cross_approximation(arrays, rows.first, rows.size(), columns.first, columns.size(), 1e-4);
    if (!product)
      continue;
    double error = 0, norm = 0;
    std::vector<float> exact(columns.size());
    std::vector<std::int32_t> state(columns.size());
    for (std::uint32_t i = 0; i < rows.size(); ++i) {
      pair_row(arrays, rows.first + i, columns.first, columns.last, exact.data(), state.data());
      for (std::uint32_t j = 0; j < columns.size(); ++j) {
        double sum = 0;
        for (std::uint32_t k = 0; k < product->rank; ++k)
          sum += static_cast<double>(product->values[i * product->rank + k]) *
                 static_cast<double>(product->values[(rows.size() + j) * product->rank + k]);
        error += std::pow(sum - static_cast<double>(exact[j]), 2);
        norm += std::pow(static_cast<double>(exact[j]), 2);
      }
    }
    EXPECT_LT(std::sqrt(error / norm), 5e-4) << "rank " << product->rank;
  }
  EXPECT_GT(checked, 20u);
}

TEST(ExchangeMatrix, hierarchical_and_dense_rows_agree) {
  // Twin: with a tolerance of zero no low-rank product is smaller than its rectangle, so that all entries are kept.
  const Furnished f(3000);
  ExchangeReport thin, full;
  const auto low = exchange_areas(f.set, f.mesh, f.room, f.rays, {}, kSilent, &thin);
  const auto dense = exchange_areas(f.set, f.mesh, f.room, f.rays, {.low_rank_tolerance = 0.0}, kSilent, &full);
  ASSERT_TRUE(low && dense);
  EXPECT_GT(thin.low_rank_pairs, 100000u);
  EXPECT_EQ(full.low_rank_pairs, 0u);
  EXPECT_LT(thin.bytes, full.bytes);
  const auto a = low->row_sums(), b = dense->row_sums();
  for (std::size_t i = 0; i < a.size(); ++i)
    ASSERT_NEAR(a[i] / f.set.patches[i].area_m2, b[i] / f.set.patches[i].area_m2, 1e-4) << i;
}

TEST(ExchangeMatrix, product_is_that_of_the_entries) {
  const Furnished f(700);
  const auto m = exchange_areas(f.set, f.mesh, f.room, f.rays, {}, kSilent);
  ASSERT_TRUE(m);
  const std::size_t n = m->size(), w = 3;
  const std::vector<float> g = dense(*m);
  std::vector<float> x(n * w), y(n * w);
  for (std::size_t k = 0; k < x.size(); ++k)
    x[k] = static_cast<float>(k * 2654435761u % 1000u) * 1e-3f;
  m->multiply(x.data(), w, y.data());
  for (std::size_t i = 0; i < n; i += 13)
    for (std::size_t c = 0; c < w; ++c) {
      double sum = 0;
      for (std::size_t j = 0; j < n; ++j)
        sum += static_cast<double>(g[m->order()[i] * n + m->order()[j]]) * static_cast<double>(x[j * w + c]);
      ASSERT_NEAR(y[i * w + c], sum, 1e-5 * sum) << i;
    }
}

TEST(ExchangeMatrix, pairs_of_black_surfaces_are_left_out_and_change_no_light) {
  Furnished f(700);
  f.room.materials.push_back({"black", Rgb(0.0f), Rgb(1.0f), false});
  for (Patch& e : f.set.patches)
    if (e.normal.z > 0.5 || e.normal.y > 0.5) // floor, table tops and walls that look north
      e.reflectance = Rgb(0.0f);
  ExchangeReport with, without;
  const auto all = exchange_areas(f.set, f.mesh, f.room, f.rays, {}, kSilent, &with);
  const auto some = exchange_areas(f.set, f.mesh, f.room, f.rays, {.skip_black = true}, kSilent, &without);
  const auto light = first_bounce(f.set, f.mesh, f.scene, f.apertures, *SkyPartition::uniform(16), kSilent);
  ASSERT_TRUE(all && some && light);
  EXPECT_EQ(with.black_pairs, 0u);
  EXPECT_GT(without.black_pairs, 1000u);
  EXPECT_LT(without.facing_pairs, with.facing_pairs);
  const auto a = solve_radiosity(f.set, *all, *light, {.tolerance = 1e-6}, kSilent),
             b = solve_radiosity(f.set, *some, *light, {.tolerance = 1e-6}, kSilent);
  ASSERT_TRUE(a && b);
  const float largest = *std::ranges::max_element(a->b);
  for (std::size_t k = 0; k < a->b.size(); ++k)
    ASSERT_NEAR(a->b[k], b->b[k], 2e-6f * largest);
  EXPECT_LT(audit_energy(f.set, *some, *light, *b).imbalance, 1e-4);
}

TEST(FormFactors, every_row_of_a_furnished_room_closes_within_a_thousandth) {
  for (const bool turned : {false, true}) {
    const Furnished f(1500, turned);
    const auto m = exchange_areas(f.set, f.mesh, f.room, f.rays, {}, kSilent);
    const auto light = first_bounce(f.set, f.mesh, f.scene, f.apertures, *SkyPartition::uniform(8192), kSilent);
    ASSERT_TRUE(m && light);
    const auto sums = m->row_sums();
    double worst = 0, mean = 0, area = 0;
    for (std::size_t i = 0; i < sums.size(); ++i) {
      const double closure = sums[i] / f.set.patches[i].area_m2 + static_cast<double>(light->opening[i]) - 1.0;
      worst = std::max(worst, std::abs(closure));
      mean += closure * f.set.patches[i].area_m2;
      area += f.set.patches[i].area_m2;
    }
    std::printf("rows: worst %.2e, mean %.1e\n", worst, mean / area);
    EXPECT_LT(worst, 1e-3);
    EXPECT_LT(std::abs(mean / area), 2e-5);
  }
}

} // namespace
} // namespace daylit::radiosity
