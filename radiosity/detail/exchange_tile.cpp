#include "radiosity/detail/exchange_tile.h"

#include <algorithm>
#include <optional>
#include <vector>

#include <glm/geometric.hpp>

#include "radiosity/detail/low_rank.h"
#include "radiosity/detail/pair_shadow.h"
#include "radiosity/detail/pair_visibility.h"
#include "radiosity/polygon_kernel.h"

namespace daylit::radiosity {

namespace {

constexpr std::size_t kMostObstacles = 24; // between two leaves; more are left to the rays
constexpr double kShadowTolerance = 3e-6;  // of the room's size, above the rounding of float coordinates

/// The values of one tile, row-major, and the pairs among them that need rays.
struct Tile {
  const Cluster &a, &b;
  std::vector<float> values;
  std::vector<PairQuery> queries;
  std::vector<FacingParts> parts; ///< of queries whose patches face each other in part
  std::uint64_t facing = 0, near = 0, clear = 0, hidden = 0;

  Tile(const Cluster& rows, const Cluster& columns)
      : a(rows), b(columns), values(std::size_t{rows.size()} * columns.size()) {}
  float& at(std::uint32_t i, std::uint32_t j) { return values[std::size_t{i - a.first} * b.size() + (j - b.first)]; }
};

/// What two patches show each other of their fronts.
struct NearPair {
  SmallPolygon a, b;
  bool cut; ///< one of them in part only

  NearPair(const Patch& p, const Patch& q)
      : a(clip_to_front({{p.corner[0], p.corner[1], p.corner[2]}, 3}, q.corner[0], q.normal)),
        b(clip_to_front({{q.corner[0], q.corner[1], q.corner[2]}, 3}, p.corner[0], p.normal)),
        cut(rises_from_behind(p, q) || rises_from_behind(q, p)) {}
  /// G = A F by the contour integral, m^2.
  double exchange_m2() const { return a.size < 3 || b.size < 3 ? 0.0 : exchange_area_unoccluded(a, b); }

private:
  static bool rises_from_behind(const Patch& p, const Patch& q) {
    return std::ranges::any_of(p.corner,
                               [&](const glm::dvec3& c) { return glm::dot(c - q.corner[0], q.normal) < 0.0; });
  }
};

/// The unoccluded exchange of a pair, with what is known of its visibility.
void enter_pair(const ExchangeProblem& problem, Tile& tile, const PairShadows* shadows, std::uint32_t i,
                std::uint32_t j, PairState state, PairShadow shadow) {
  ++tile.facing;
  float& g = tile.at(i, j);
  if (shadow == kHiddenPair) {
    ++tile.hidden;
    g = 0.0f;
    return;
  }
  const std::uint64_t seed = std::uint64_t{problem.tree.order()[i]} << 32 | problem.tree.order()[j];
  PairQuery query{i, j, seed, 0.0f, state == kNear};
  if (state == kNear) {
    const NearPair pair(problem.patch(i), problem.patch(j));
    g = static_cast<float>(pair.exchange_m2());
    ++tile.near;
    if (shadow == kMixedPair && g > 0.0f && pair.cut) {
      if (shadows && shadows->clear(pair.a, pair.b))
        shadow = kClearPair;
      query.parts = static_cast<std::int32_t>(tile.parts.size());
      if (shadow == kMixedPair)
        tile.parts.emplace_back(pair.a, pair.b, problem.shift);
    }
  }
  if (shadow == kClearPair) {
    ++tile.clear;
    return;
  }
  query.form_factor = g / std::min(problem.arrays.area[i], problem.arrays.area[j]);
  if (g > 0.0f)
    tile.queries.push_back(query);
}

/// What may stand between the pairs of a tile; nothing: too much to look at one by one.
std::optional<PairShadows> shadows_of(const ExchangeProblem& problem, const Tile& tile) {
  const BlockVisibility::Between between = problem.visibility.between(problem.tree, tile.a, tile.b, kMostObstacles);
  if (!between.complete)
    return std::nullopt;
  return PairShadows(problem.arrays, problem.visibility.obstacles(), between.items, problem.shift, tile.b.first,
                     tile.b.last, static_cast<float>(kShadowTolerance * diameter(problem.tree[0].box)));
}

/// Kernel of a row of pairs, then what can be decided without rays, then rays for the rest.
void compute_tile(ExchangeProblem& problem, const PlanTile& plan, Tile& tile) {
  std::vector<std::int32_t> state(tile.b.size()), shadow(tile.b.size(), plan.clear ? kClearPair : kMixedPair);
  std::optional<PairShadows> shadows = plan.clear ? std::nullopt : shadows_of(problem, tile);
  for (std::uint32_t i = tile.a.first; i < tile.a.last; ++i) {
    const std::uint32_t first = plan.a == plan.b ? i + 1 : tile.b.first;
    if (first >= tile.b.last)
      break;
    pair_row(problem.arrays, i, first, tile.b.last, &tile.at(i, first), state.data());
    if (shadows)
      shadows->row(i, shadow.data());
    for (std::uint32_t j = first; j < tile.b.last; ++j)
      if (state[j - first] != kNotFacing)
        enter_pair(problem, tile, shadows ? &*shadows : nullptr, i, j, static_cast<PairState>(state[j - first]),
                   static_cast<PairShadow>(shadow[j - tile.b.first]));
  }
  if (!tile.queries.empty()) {
    PairVisibility visibility(problem.arrays, problem.scene, problem.options.visibility_rays);
    problem.counters.rays += visibility.resolve(tile.queries, tile.parts);
    for (const PairQuery& q : tile.queries)
      tile.at(q.i, q.j) *= q.visibility;
  }
  problem.counters.facing += tile.facing;
  problem.counters.near += tile.near;
  problem.counters.clear += tile.clear;
  problem.counters.hidden += tile.hidden;
  problem.counters.sampled += tile.queries.size();
}

} // namespace

void fill_tile(ExchangeProblem& problem, const PlanTile& plan, ExchangeBlock& block) {
  Tile tile(problem.tree[plan.a], problem.tree[plan.b]);
  compute_tile(problem, plan, tile);
  for (std::uint32_t i = tile.a.first; i < tile.a.last; ++i)
    for (std::uint32_t j = plan.a == plan.b ? i + 1 : tile.b.first; j < tile.b.last; ++j) {
      const float g = tile.at(i, j);
      block.values[std::size_t{i - block.row} * block.columns + (j - block.column)] = g;
      if (block.diagonal())
        block.values[std::size_t{j - block.row} * block.columns + (i - block.column)] = g;
    }
}

void fill_low_rank(ExchangeProblem& problem, const PlanTile& plan, ExchangeBlock& block) {
  auto crosses = cross_approximation(problem.arrays, block.row, block.rows, block.column, block.columns,
                                     problem.options.low_rank_tolerance);
  if (crosses) {
    block.rank = crosses->rank;
    block.values = std::move(crosses->values);
    problem.counters.low_rank += std::uint64_t{block.rows} * block.columns;
    return;
  }
  block.values.assign(std::size_t{block.rows} * block.columns, 0.0f);
  fill_tile(problem, plan, block);
}

} // namespace daylit::radiosity
