#include "radiosity/form_factors.h"

#include <glm/geometric.hpp>

#include "radiosity/detail/exchange_tasks.h"
#include "radiosity/detail/obstacles.h"
#include "scene/core/seconds.h"

namespace daylit::radiosity {

namespace {

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

} // namespace

/// Cluster tree, obstacles, plan of blocks, then the blocks.
Result<ExchangeMatrix> exchange_areas(const PatchSet& set, const SurfaceMesh& mesh, const Room& room,
                                      const RayScene& rays, const ExchangeOptions& options, const Progress& progress,
                                      ExchangeReport* report) {
  const double start = wall_seconds();
  const ClusterTree tree = patch_tree(set, mesh);
  const BlockVisibility visibility(convex_obstacles(room, mesh.origin));
  const ExchangePlan plan = plan_exchange(tree, visibility, {.black = black_positions(set, tree, options)});
  if (4.0 * plan.values > static_cast<double>(options.max_bytes))
    return Error{ErrorCode::limit_exceeded,
                 std::to_string(set.patches.size()) + " patches need more memory for their form factors than allowed",
                 "form factors", "use a larger --patch-size"};
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
