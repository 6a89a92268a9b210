#include "radiosity/form_factors.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>
#include <span>
#include <vector>

#include <glm/geometric.hpp>

#include "radiosity/detail/exchange_tile.h"
#include "radiosity/detail/obstacles.h"
#include "scene/core/parallel_stage.h"
#include "scene/core/seconds.h"

namespace daylit::radiosity {

namespace {

constexpr std::size_t kReport = 256, kFewestInGroup = 512; // tasks

using Counts = std::array<std::uint64_t, 7>; ///< as ExchangeCounters::values()

/// The smallest unit of work: tiles write disjoint parts of their block.
struct ExchangeTask {
  std::size_t block, tile;
  bool low_rank;
};

/// In the order of the plan, which depends on the geometry alone.
std::vector<ExchangeTask> tasks_of(const ExchangePlan& plan) {
  std::vector<ExchangeTask> tasks;
  for (std::size_t b = 0; b < plan.blocks.size(); ++b)
    for (std::size_t t = 0; t < plan.blocks[b].tiles; ++t)
      tasks.push_back({b, plan.blocks[b].first_tile + t, plan.blocks[b].low_rank});
  return tasks;
}

/// Tasks first .. last - 1 as bytes: what they counted, then rank and values of each.
class TaskGroup {
public:
  TaskGroup(const ExchangeProblem& problem, const ExchangePlan& plan, const std::vector<ExchangeTask>& tasks,
            std::vector<ExchangeBlock>& blocks, std::size_t first, std::size_t last)
      : problem_(problem), plan_(plan), tasks_(tasks), blocks_(blocks), first_(first), last_(last) {}

  std::vector<std::byte> bytes(const Counts& counted) const {
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
  bool take(std::span<const std::byte> in, Counts& counted) {
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

  const ExchangeProblem& problem_;
  const ExchangePlan& plan_;
  const std::vector<ExchangeTask>& tasks_;
  std::vector<ExchangeBlock>& blocks_;
  std::size_t first_, last_;
};

/// Fills tasks [first, last) in parallel; progress counts all tasks.
Result<void> compute(ExchangeProblem& problem, const ExchangePlan& plan, const std::vector<ExchangeTask>& tasks,
                     std::vector<ExchangeBlock>& blocks, std::size_t first, std::size_t last,
                     const Progress& progress) {
  const auto overall = [&](const std::string& stage, double fraction) {
    const double done = static_cast<double>(first) + fraction * static_cast<double>(last - first);
    return progress(stage, done / static_cast<double>(tasks.size()));
  };
  return parallel_stage("form factors", last - first, kReport, overall, [&](std::size_t t) {
    const ExchangeTask& task = tasks[first + t];
    (task.low_rank ? fill_low_rank : fill_tile)(problem, plan.tiles[task.tile], blocks[task.block]);
  });
}

/// Fills all blocks of the plan: from the store of the problem's options where they are there, else computed and kept.
/// Error: interrupted.
Result<void> fill_blocks(ExchangeProblem& problem, const ExchangePlan& plan, std::vector<ExchangeBlock>& blocks,
                         const Progress& progress) {
  const std::vector<ExchangeTask> tasks = tasks_of(plan);
  WorkStore* store = problem.options.store;
  const std::size_t group =
      store ? std::max(kFewestInGroup, tasks.size() / 64) : std::max<std::size_t>(tasks.size(), 1);
  for (std::size_t first = 0; first < tasks.size(); first += group) {
    const std::size_t last = std::min(tasks.size(), first + group);
    TaskGroup part(problem, plan, tasks, blocks, first, last);
    const WorkStore::Name name{WorkStore::Stage::exchange, 0, first};
    Counts counted{};
    const auto found = store ? store->find(name) : std::nullopt;
    if (found && part.take(*found, counted)) {
      problem.counters.add(counted);
      continue;
    }
    const Counts before = problem.counters.values();
    if (const Result<void> done = compute(problem, plan, tasks, blocks, first, last, progress); !done)
      return done;
    const Counts after = problem.counters.values();
    for (std::size_t k = 0; k < counted.size(); ++k)
      counted[k] = after[k] - before[k];
    if (store)
      store->keep(name, part.bytes(counted));
  }
  return {};
}

constexpr std::uint32_t kSmallLeaf = 32, kLeaf = 64;
constexpr std::size_t kManyPatches = 6000; // from here on the larger leaf: fewer decisions

/// Sides of one plane that look the same way have one id: they cannot see each other.
ClusterTree patch_tree(const PatchSet& set, const SurfaceMesh& mesh) {
  std::vector<ClusterItem> items;
  for (const Patch& e : set.patches) {
    const Facet& p = mesh.facets[e.facet];
    items.push_back({e.corner, e.normal, 2 * p.plane + (glm::dot(e.normal, p.normal) < 0.0 ? 1u : 0u)});
  }
  return ClusterTree(items, set.patches.size() < kManyPatches ? kSmallLeaf : kLeaf);
}

/// Which tree positions have patches that reflect nothing; empty when that does not matter.
std::vector<bool> black_positions(const PatchSet& set, const ClusterTree& tree, const ExchangeOptions& options) {
  std::vector<bool> black;
  for (const std::uint32_t patch : tree.order())
    if (options.skip_black)
      black.push_back(set.patches[patch].reflectance == Rgb(0.0f));
  return black;
}

ExchangeBlock empty_block(const ClusterTree& tree, const PlanBlock& plan) {
  const Cluster &a = tree[plan.a], &b = tree[plan.b];
  return {a.first, a.size(), b.first, b.size(), 0, {}};
}

void fill_report(const ExchangeProblem& problem, const ExchangeMatrix& m, ExchangeReport& report) {
  const ExchangeCounters& c = problem.counters;
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

double bytes_of(const ExchangePlan& plan) { return 4.0 * plan.values; }

Result<ExchangePlan> allowed_plan(const PatchSet& set, const ClusterTree& tree, const BlockVisibility& visibility,
                                  const ExchangeOptions& options) {
  ExchangePlan plan = plan_exchange(tree, visibility, {.black = black_positions(set, tree, options)});
  if (bytes_of(plan) > static_cast<double>(options.max_bytes))
    return Error{ErrorCode::limit_exceeded,
                 std::to_string(set.patches.size()) + " patches need more memory for their form factors than allowed",
                 "form factors", "use a larger --patch-size"};
  return plan;
}

} // namespace

Result<double> exchange_bytes(const PatchSet& set, const SurfaceMesh& mesh, const Room& room,
                              const ExchangeOptions& options) {
  const ClusterTree tree = patch_tree(set, mesh);
  const BlockVisibility visibility(convex_obstacles(room, mesh.origin));
  const Result<ExchangePlan> plan = allowed_plan(set, tree, visibility, options);
  if (!plan)
    return plan.error();
  return bytes_of(*plan);
}

/// Cluster tree, obstacles, plan of blocks, then the blocks.
Result<ExchangeMatrix> exchange_areas(const PatchSet& set, const SurfaceMesh& mesh, const Room& room,
                                      const RayScene& rays, const ExchangeOptions& options, const Progress& progress,
                                      ExchangeReport* report) {
  const double start = wall_seconds();
  const ClusterTree tree = patch_tree(set, mesh);
  const BlockVisibility visibility(convex_obstacles(room, mesh.origin));
  const Result<ExchangePlan> allowed = allowed_plan(set, tree, visibility, options);
  if (!allowed)
    return allowed.error();
  const ExchangePlan& plan = *allowed;
  const glm::dvec3 shift = mesh.origin - rays.origin();
  ExchangeProblem problem{set, rays, options, tree, visibility, PairArrays(set, tree.order(), shift), shift, {}};
  std::vector<ExchangeBlock> blocks;
  for (const PlanBlock& b : plan.blocks) {
    blocks.push_back(empty_block(tree, b));
    if (!b.low_rank)
      blocks.back().values.assign(std::size_t{blocks.back().rows} * blocks.back().columns, 0.0f);
  }
  if (const Result<void> filled = fill_blocks(problem, plan, blocks, progress); !filled)
    return filled.error();
  ExchangeMatrix m(tree.order(), std::move(blocks));
  if (report) {
    fill_report(problem, m, *report);
    report->black_pairs = plan.black_pairs;
    report->seconds = wall_seconds() - start;
  }
  return m;
}

} // namespace daylit::radiosity
