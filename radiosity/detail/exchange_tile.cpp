#include "radiosity/detail/exchange_tile.h"

#include <algorithm>
#include <optional>
#include <vector>

#include <glm/geometric.hpp>

#include "radiosity/detail/low_rank.h"
#include "radiosity/detail/pair_shadow.h"
#include "radiosity/detail/pair_visibility.h"
#include "radiosity/polygon_kernel.h"
#include "scene/core/parallel.h"

namespace daylit::radiosity {

namespace {

constexpr double kExpectedRank = 9;
constexpr double kWorthSplitting = 0.95; // a rectangle of more than this part of the work is kept as one dense block
constexpr std::uint32_t kParallelSize = 256; // of the larger cluster

class Planner {
public:
  Planner(const ClusterTree& tree, const BlockVisibility& visibility, const PlanOptions& options)
      : tree_(tree), visibility_(visibility), options_(options) {
    for (const Cluster& c : tree.clusters())
      black_.push_back(!options.black.empty() &&
                       std::find(options.black.begin() + c.first, options.black.begin() + c.last, false) ==
                           options.black.begin() + c.last);
  }

  /// Block cluster tree of a hierarchical matrix (Hackbusch 2015): nothing where two clusters cannot see each other,
  /// a product where the kernel between them is smooth, dense between leaves, else the children.
  ExchangePlan plan(std::int32_t a, std::int32_t b, bool clear) const {
    const Cluster &ca = tree_[a], &cb = tree_[b];
    if (cannot_see(ca, cb))
      return {};
    if (black_[static_cast<std::size_t>(a)] && black_[static_cast<std::size_t>(b)])
      return nothing(std::uint64_t{ca.size()} * (a == b ? ca.size() - 1 : 2 * cb.size()) / 2);
    if (a == b)
      return ca.childless()
                 ? dense(a, b, false)
                 : coalesce(a, b,
                            join({{{ca.child[0], ca.child[0]}, {ca.child[0], ca.child[1]}, {ca.child[1], ca.child[1]}}},
                                 ca.size(), false));
    if (!clear) {
      const Visibility seen = visibility_.between_clusters(tree_, ca, cb);
      if (seen == Visibility::hidden)
        return {};
      clear = seen == Visibility::clear;
    }
    if (clear && smooth(ca, cb))
      return low_rank(a, b);
    if (ca.childless() && cb.childless())
      return dense(a, b, clear);
    return coalesce(a, b, split(a, b, clear));
  }

private:
  using Pair = std::array<std::int32_t, 2>;

  bool cannot_see(const Cluster& a, const Cluster& b) const {
    return (a.plane >= 0 && a.plane == b.plane) || visibility_.behind(tree_, a, b) || visibility_.behind(tree_, b, a);
  }
  /// Admissible: distance >= separation * larger diameter, and neither horizon nor touching edges disturb the kernel.
  bool smooth(const Cluster& a, const Cluster& b) const {
    return std::min(a.size(), b.size()) >= options_.min_size &&
           distance(a.box, b.box) >= options_.separation * std::max(diameter(a.box), diameter(b.box)) &&
           visibility_.in_front(tree_, a, b) && visibility_.in_front(tree_, b, a);
  }

  static ExchangePlan nothing(std::uint64_t black_pairs) {
    ExchangePlan none;
    none.black_pairs = black_pairs;
    return none;
  }
  ExchangePlan dense(std::int32_t a, std::int32_t b, bool clear) const {
    return {{{a, b, false, 0, 1}}, {{a, b, clear}}, area(a, b), work(a, b), 0};
  }
  ExchangePlan low_rank(std::int32_t a, std::int32_t b) const {
    const double values = kExpectedRank * (tree_[a].size() + tree_[b].size());
    return {{{a, b, true, 0, 1}}, {{a, b, true}}, values, 2 * values, 0};
  }
  double area(std::int32_t a, std::int32_t b) const {
    return static_cast<double>(tree_[a].size()) * static_cast<double>(tree_[b].size());
  }
  double work(std::int32_t a, std::int32_t b) const { return (a == b ? 1 : 2) * area(a, b); }

  ExchangePlan split(std::int32_t a, std::int32_t b, bool clear) const {
    const Cluster &ca = tree_[a], &cb = tree_[b];
    const std::uint32_t size = std::max(ca.size(), cb.size());
    const bool cut_a = !ca.childless() && (cb.childless() || 2 * diameter(ca.box) > diameter(cb.box));
    const bool cut_b = !cb.childless() && (ca.childless() || 2 * diameter(cb.box) > diameter(ca.box));
    if (cut_a && cut_b)
      return join({{{ca.child[0], cb.child[0]},
                    {ca.child[0], cb.child[1]},
                    {ca.child[1], cb.child[0]},
                    {ca.child[1], cb.child[1]}}},
                  size, clear);
    if (cut_a)
      return join({{{ca.child[0], b}, {ca.child[1], b}}}, size, clear);
    return join({{{a, cb.child[0]}, {a, cb.child[1]}}}, size, clear);
  }

  ExchangePlan join(const std::vector<Pair>& pairs, std::uint32_t size, bool clear) const {
    std::array<ExchangePlan, 4> part;
    const auto one = [&](std::size_t k) {
      if (k < pairs.size())
        part[k] = plan(pairs[k][0], pairs[k][1], clear);
    };
    if (size >= kParallelSize)
      parallel_for(std::size_t{0}, pairs.size(), one);
    else
      for (std::size_t k = 0; k < pairs.size(); ++k)
        one(k);
    ExchangePlan all;
    for (ExchangePlan& p : part) {
      for (PlanBlock& b : p.blocks) {
        b.first_tile += all.tiles.size();
        all.blocks.push_back(b);
      }
      all.tiles.insert(all.tiles.end(), p.tiles.begin(), p.tiles.end());
      all.values += p.values;
      all.work += p.work;
      all.black_pairs += p.black_pairs;
    }
    return all;
  }

  /// Many small products cost more than one large one.
  ExchangePlan coalesce(std::int32_t a, std::int32_t b, ExchangePlan parts) const {
    if (parts.blocks.empty() || parts.work < kWorthSplitting * work(a, b))
      return parts;
    parts.blocks = {{a, b, false, 0, parts.tiles.size()}};
    parts.values = area(a, b);
    parts.work = work(a, b);
    return parts;
  }

  const ClusterTree& tree_;
  const BlockVisibility& visibility_;
  const PlanOptions& options_;
  std::vector<bool> black_; ///< per cluster
};

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
  query.form_factor = g / std::min(problem.arrays.area[i], problem.arrays.area[j]) *
                      std::max(problem.patch(i).worth(), problem.patch(j).worth());
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

ExchangePlan plan_exchange(const ClusterTree& tree, const BlockVisibility& visibility, const PlanOptions& options) {
  if (tree.clusters().empty())
    return {};
  return Planner(tree, visibility, options).plan(0, 0, false);
}

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
