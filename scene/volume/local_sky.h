#pragma once

// What the places of objects in one volume share, and the factors of a compact basis at some of its probes.

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "scene/volume/volume.h"

namespace daylit::detail {

constexpr std::size_t kLanes = 16;                    ///< components come in groups of these while a place is prepared
constexpr std::size_t kMostGroups = 4;                ///< of lanes
constexpr std::size_t kSketch = kLanes * kMostGroups; ///< random skies
constexpr std::size_t kChunkRows = 512;               ///< of a table: their radiances are rounded together

struct LocalSkyData {
  struct Weight {
    std::uint32_t source;
    float weight;
  };
  /// The first light of all colours, or of one colour, by region: weights first[row] to first[row + 1].
  struct Table {
    std::vector<std::uint32_t> first;
    std::vector<Weight> weight;
  };
  std::shared_ptr<const CompactBasis> basis;
  std::size_t probes = 0, regions = 0;
  struct Run {
    std::uint32_t first_region = 0, count = 0;
  };
  /// Regions that light anything; the rows of the tables are the regions of the runs. None crosses a multiple of
  /// kChunkRows.
  std::vector<Run> run;
  std::size_t rows = 0;
  std::vector<Table> table; ///< one, or three where panes are tinted
  std::vector<float> seen;  ///< [component][kSketch]: random skies, seen by each component
};

LocalSkyData make_local_sky(std::shared_ptr<const CompactBasis> basis, std::size_t probes, std::size_t regions);

/// The factors of the bricks that hold the wanted probes.
struct LocalFactors {
  std::size_t numbers = 0, components = 0, sources = 0;
  std::array<std::vector<float>, 3> probe; ///< of each colour: [wanted probe * 9 + lm][component]
  std::vector<float> source;               ///< [source][component]
  std::vector<float> seen;                 ///< [component][kSketch]
};
LocalFactors local_factors(const LocalSkyData& sky, std::span<const std::uint32_t> wanted);

} // namespace daylit::detail
