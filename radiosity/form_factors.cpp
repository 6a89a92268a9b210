#include "radiosity/form_factors.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstring>
#include <optional>

#include <glm/geometric.hpp>

#include "radiosity/detail/exchange_plan.h"
#include "radiosity/detail/low_rank.h"
#include "radiosity/detail/obstacles.h"
#include "radiosity/detail/pair_kernel.h"
#include "radiosity/detail/pair_shadow.h"
#include "radiosity/detail/pair_visibility.h"
#include "radiosity/detail/sampling.h"
#include "radiosity/polygon_kernel.h"
#include "scene/core/parallel.h"

namespace daylit::radiosity {

namespace {

constexpr std::uint32_t kSmallLeaf = 32, kLeaf = 64;
constexpr std::size_t kMostObstacles = 24; // between two leaves; more are left to the rays
constexpr double kShadowTolerance = 3e-6;  // of the room's size, above the rounding of float coordinates
constexpr std::size_t kManyPatches = 6000; // from here on the larger leaf: fewer decisions

struct Counters {
  std::atomic<std::uint64_t> facing{0}, near{0}, clear{0}, hidden{0}, low_rank{0}, sampled{0}, rays{0};

  std::array<std::uint64_t, 7> values() const { return {facing, near, clear, hidden, low_rank, sampled, rays}; }
  void add(const std::array<std::uint64_t, 7>& more) {
    facing += more[0];
    near += more[1];
    clear += more[2];
    hidden += more[3];
    low_rank += more[4];
    sampled += more[5];
    rays += more[6];
  }
};

ClusterTree patch_tree(const PatchSet& set, const SurfaceMesh& mesh) {
  std::vector<ClusterItem> items;
  for (const Patch& e : set.patches) {
    const Facet& p = mesh.facets[e.facet];
    items.push_back({e.corner, e.normal, 2 * p.plane + (glm::dot(e.normal, p.normal) < 0.0 ? 1u : 0u)});
  }
  return ClusterTree(items, set.patches.size() < kManyPatches ? kSmallLeaf : kLeaf);
}

/// Which tree positions reflect nothing; empty when that does not matter.
std::vector<bool> black_positions(const PatchSet& set, const ClusterTree& tree, const ExchangeOptions& options) {
  std::vector<bool> black;
  for (const std::uint32_t patch : tree.order())
    if (options.skip_black)
      black.push_back(set.patches[patch].reflectance == Rgb(0.0f));
  return black;
}

/// What all tiles of one run share.
struct Problem {
  const PatchSet& set;
  const RayScene& scene;
  const ExchangeOptions& options;
  const ClusterTree& tree;
  const BlockVisibility& visibility;
  PairArrays arrays;
  glm::dvec3 shift; ///< from the frame of the mesh to that of the rays and `arrays`
  Counters counters;

  const Patch& patch(std::uint32_t position) const { return set.patches[tree.order()[position]]; }
};

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
  double exchange_m2() const { return a.size < 3 || b.size < 3 ? 0.0 : exchange_area_unoccluded(a, b); }

private:
  static bool rises_from_behind(const Patch& p, const Patch& q) {
    return std::ranges::any_of(p.corner,
                               [&](const glm::dvec3& c) { return glm::dot(c - q.corner[0], q.normal) < 0.0; });
  }
};

/// The unoccluded exchange of a pair, with what is known of its visibility.
void enter_pair(const Problem& problem, Tile& tile, const PairShadows* shadows, std::uint32_t i, std::uint32_t j,
                PairState state, PairShadow shadow) {
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
std::optional<PairShadows> shadows_of(const Problem& problem, const Tile& tile) {
  const BlockVisibility::Between between = problem.visibility.between(problem.tree, tile.a, tile.b, kMostObstacles);
  if (!between.complete)
    return std::nullopt;
  return PairShadows(problem.arrays, problem.visibility.obstacles(), between.items, problem.shift, tile.b.first,
                     tile.b.last, static_cast<float>(kShadowTolerance * diameter(problem.tree[0].box)));
}

void compute_tile(Problem& problem, const PlanTile& plan, Tile& tile) {
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
      tile.at(q.i, q.j) *= q.share;
  }
  problem.counters.facing += tile.facing;
  problem.counters.near += tile.near;
  problem.counters.clear += tile.clear;
  problem.counters.hidden += tile.hidden;
  problem.counters.sampled += tile.queries.size();
}

void fill_tile(Problem& problem, const PlanTile& plan, ExchangeBlock& block) {
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

ExchangeBlock empty_block(const ClusterTree& tree, const PlanBlock& plan) {
  const Cluster &a = tree[plan.a], &b = tree[plan.b];
  return {a.first, a.size(), b.first, b.size(), 0, {}};
}

void fill_low_rank(Problem& problem, const PlanTile& plan, ExchangeBlock& block) {
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

/// One piece of work: tiles write disjoint parts of their block.
struct Task {
  std::size_t block, tile;
  bool low_rank;
};

std::vector<Task> tasks_of(const ExchangePlan& plan) {
  std::vector<Task> tasks;
  for (std::size_t b = 0; b < plan.blocks.size(); ++b)
    for (std::size_t t = 0; t < plan.blocks[b].tiles; ++t)
      tasks.push_back({b, plan.blocks[b].first_tile + t, plan.blocks[b].low_rank});
  return tasks;
}

/// Tasks first .. last - 1 as bytes: what they counted, then rank and values of each.
class TaskGroup {
public:
  TaskGroup(const Problem& problem, const ExchangePlan& plan, const std::vector<Task>& tasks,
            std::vector<ExchangeBlock>& blocks, std::size_t first, std::size_t last)
      : problem_(problem), plan_(plan), tasks_(tasks), blocks_(blocks), first_(first), last_(last) {}

  std::vector<std::byte> bytes(const std::array<std::uint64_t, 7>& counted) const {
    std::vector<std::byte> out;
    append(out, counted.data(), sizeof counted);
    for (std::size_t t = first_; t < last_; ++t) {
      const ExchangeBlock& b = blocks_[tasks_[t].block];
      append(out, &b.rank, sizeof b.rank);
      if (tasks_[t].low_rank)
        append(out, b.values.data(), b.values.size() * sizeof(float));
      else
        for_each_row(t, [&](std::size_t offset, std::size_t count) {
          append(out, b.values.data() + offset, count * sizeof(float));
        });
    }
    return out;
  }

  /// False, and nothing of use in the blocks, when the bytes are not those of this group.
  bool take(std::span<const std::byte> in, std::array<std::uint64_t, 7>& counted) {
    if (!extract(in, counted.data(), sizeof counted))
      return false;
    for (std::size_t t = first_; t < last_; ++t) {
      ExchangeBlock& b = blocks_[tasks_[t].block];
      bool good = extract(in, &b.rank, sizeof b.rank);
      if (tasks_[t].low_rank) {
        const std::size_t values =
            b.rank > 0 ? std::size_t{b.rank} * (b.rows + b.columns) : std::size_t{b.rows} * b.columns;
        good = good && values * sizeof(float) <= in.size();
        b.values.resize(good ? values : 0);
        good = good && extract(in, b.values.data(), values * sizeof(float));
      } else {
        for_each_row(t, [&](std::size_t offset, std::size_t count) {
          good = good && extract(in, b.values.data() + offset, count * sizeof(float));
        });
        mirror(t);
      }
      if (!good)
        return false;
    }
    return in.empty();
  }

private:
  static void append(std::vector<std::byte>& out, const void* data, std::size_t bytes) {
    const auto* p = static_cast<const std::byte*>(data);
    out.insert(out.end(), p, p + bytes);
  }
  static bool extract(std::span<const std::byte>& in, void* data, std::size_t bytes) {
    if (in.size() < bytes)
      return false;
    std::memcpy(data, in.data(), bytes);
    in = in.subspan(bytes);
    return true;
  }
  template <class Visit>
  void for_each_row(std::size_t t, const Visit& visit) const {
    const PlanTile& tile = plan_.tiles[tasks_[t].tile];
    const ExchangeBlock& b = blocks_[tasks_[t].block];
    const Cluster &rows = problem_.tree[tile.a], &columns = problem_.tree[tile.b];
    for (std::uint32_t i = rows.first; i < rows.last; ++i)
      visit(std::size_t{i - b.row} * b.columns + (columns.first - b.column), std::size_t{columns.size()});
  }
  void mirror(std::size_t t) {
    const PlanTile& tile = plan_.tiles[tasks_[t].tile];
    ExchangeBlock& b = blocks_[tasks_[t].block];
    const Cluster &rows = problem_.tree[tile.a], &columns = problem_.tree[tile.b];
    for (std::uint32_t i = rows.first; b.diagonal() && i < rows.last; ++i)
      for (std::uint32_t j = columns.first; j < columns.last; ++j)
        b.values[std::size_t{j - b.row} * b.columns + (i - b.column)] =
            b.values[std::size_t{i - b.row} * b.columns + (j - b.column)];
  }

  const Problem& problem_;
  const ExchangePlan& plan_;
  const std::vector<Task>& tasks_;
  std::vector<ExchangeBlock>& blocks_;
  std::size_t first_, last_;
};

/// All tasks, in groups that are found in the store or computed; false: interrupted.
bool fill_blocks(Problem& problem, const ExchangePlan& plan, std::vector<ExchangeBlock>& blocks,
                 const Progress& progress) {
  const std::vector<Task> tasks = tasks_of(plan);
  WorkStore* store = problem.options.store;
  const std::size_t group =
      store ? std::max<std::size_t>(512, tasks.size() / 64) : std::max<std::size_t>(tasks.size(), 1);
  std::atomic<std::size_t> done{0};
  std::atomic<bool> stop{false};
  for (std::size_t first = 0; first < tasks.size() && !stop; first += group) {
    const std::size_t last = std::min(tasks.size(), first + group);
    TaskGroup pieces(problem, plan, tasks, blocks, first, last);
    const WorkStore::Name name{WorkStore::Stage::exchange, 0, first};
    std::array<std::uint64_t, 7> counted{};
    const auto found = store ? store->find(name) : std::nullopt;
    if (found && pieces.take(*found, counted)) {
      problem.counters.add(counted);
      done += last - first;
      continue;
    }
    const auto before = problem.counters.values();
    parallel_for(first, last, [&](std::size_t t) {
      if (stop)
        return;
      const Task& task = tasks[t];
      (task.low_rank ? fill_low_rank : fill_tile)(problem, plan.tiles[task.tile], blocks[task.block]);
      if (++done % 256 == 0 && !progress("form factors", static_cast<double>(done) / static_cast<double>(tasks.size())))
        stop = true;
    });
    const auto after = problem.counters.values();
    for (std::size_t k = 0; k < counted.size(); ++k)
      counted[k] = after[k] - before[k];
    if (store && !stop)
      store->keep(name, pieces.bytes(counted));
  }
  return !stop;
}

void fill_report(const Problem& problem, const ExchangeMatrix& m, ExchangeReport& report) {
  const Counters& c = problem.counters;
  report.facing_pairs = c.facing + c.low_rank;
  report.near_pairs = c.near;
  report.clear_pairs = c.clear + c.low_rank;
  report.low_rank_pairs = c.low_rank;
  report.hidden_pairs = c.hidden;
  report.sampled_pairs = c.sampled;
  report.rays = c.rays;
  report.bytes = m.bytes();
  double ranks = 0;
  for (const ExchangeBlock& b : m.blocks()) {
    (b.rank > 0 ? report.low_rank_blocks : report.dense_blocks) += 1;
    ranks += b.rank;
  }
  report.mean_rank = report.low_rank_blocks > 0 ? ranks / static_cast<double>(report.low_rank_blocks) : 0.0;
}

} // namespace

Result<ExchangeMatrix> exchange_areas(const PatchSet& set, const SurfaceMesh& mesh, const Room& room,
                                      const RayScene& rays, const ExchangeOptions& options, const Progress& progress,
                                      ExchangeReport* report) {
  const auto start = std::chrono::steady_clock::now();
  const ClusterTree tree = patch_tree(set, mesh);
  const BlockVisibility visibility(convex_obstacles(room, mesh.origin));
  const ExchangePlan plan = plan_exchange(tree, visibility, {.black = black_positions(set, tree, options)});
  if (4.0 * plan.values > static_cast<double>(options.max_bytes))
    return Error{ErrorCode::limit_exceeded,
                 std::to_string(set.patches.size()) + " facets need more memory for their form factors than allowed",
                 "form factors", "use a larger --patch-size"};
  const glm::dvec3 shift = mesh.origin - rays.origin();
  Problem problem{set, rays, options, tree, visibility, PairArrays(set, tree.order(), shift), shift, {}};
  std::vector<ExchangeBlock> blocks;
  for (const PlanBlock& b : plan.blocks) {
    blocks.push_back(empty_block(tree, b));
    if (!b.low_rank)
      blocks.back().values.assign(std::size_t{blocks.back().rows} * blocks.back().columns, 0.0f);
  }
  if (!fill_blocks(problem, plan, blocks, progress))
    return interrupted_error("form factors");
  ExchangeMatrix m(tree.order(), std::move(blocks));
  if (report) {
    fill_report(problem, m, *report);
    report->black_pairs = plan.black_pairs;
    report->seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  return m;
}

} // namespace daylit::radiosity
