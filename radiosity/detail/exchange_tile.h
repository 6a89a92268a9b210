#pragma once

// Exchange areas of the pairs of two clusters of patches.

#include <array>
#include <atomic>
#include <cstdint>
#include <vector>

#include <glm/vec3.hpp>

#include "radiosity/detail/block_visibility.h"
#include "radiosity/detail/cluster_tree.h"
#include "radiosity/detail/pair_kernel.h"
#include "radiosity/exchange_matrix.h"
#include "radiosity/form_factors.h"

namespace daylit::radiosity {

/// A pair of clusters whose values are computed together.
struct PlanTile {
  std::int32_t a, b; ///< clusters; a == b on the diagonal
  bool clear;        ///< nothing can stand between them
};

struct PlanBlock {
  std::int32_t a, b;
  bool low_rank = false;
  std::size_t first_tile = 0, tiles = 0; ///< of a dense block
};

/// Which rectangles of the exchange matrix are stored how, decided from the geometry alone.
struct ExchangePlan {
  std::vector<PlanBlock> blocks;
  std::vector<PlanTile> tiles;
  double values = 0;             ///< expected number of stored floats
  double work = 0;               ///< expected multiply-adds of a product with one vector
  std::uint64_t black_pairs = 0; ///< left out: neither side sends anything on
};

struct PlanOptions {
  double separation = 0.5;     ///< clusters closer than this times the larger diameter are no low-rank candidates
  std::uint32_t min_size = 32; ///< nor are smaller ones
  /// Per tree position: reflects nothing. Pairs of clusters that are all black are left out. Empty: none is.
  std::vector<bool> black = {};
};

ExchangePlan plan_exchange(const ClusterTree& tree, const BlockVisibility& visibility, const PlanOptions& options);

/// Pairs by how they were decided, and rays.
struct ExchangeCounters {
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

/// What is the same for all tiles of a run.
struct ExchangeProblem {
  const PatchSet& set;
  const RayScene& scene;
  const ExchangeOptions& options;
  const ClusterTree& tree;
  const BlockVisibility& visibility;
  PairArrays arrays;
  glm::dvec3 shift; ///< from the frame of the mesh to that of the rays and `arrays`
  ExchangeCounters counters;

  const Patch& patch(std::uint32_t position) const { return set.patches[tree.order()[position]]; }
};

/// Fills in one tile of a dense block, and its mirror image where the block lies on the diagonal.
void fill_tile(ExchangeProblem& problem, const PlanTile& plan, ExchangeBlock& block);

/// Fills in a far block as a product of low rank; densely where its rank would not pay.
void fill_low_rank(ExchangeProblem& problem, const PlanTile& plan, ExchangeBlock& block);

} // namespace daylit::radiosity
