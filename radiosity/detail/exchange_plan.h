#pragma once

// Which rectangles of the exchange matrix are stored how, decided from the geometry alone.

#include <cstdint>
#include <vector>

#include "radiosity/detail/block_visibility.h"
#include "radiosity/detail/cluster_tree.h"

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

} // namespace daylit::radiosity
