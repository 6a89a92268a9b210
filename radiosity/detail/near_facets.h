#pragma once

// Facets close to a given one: boxes of runs of facets, which the order of a mesh keeps compact.

#include <algorithm>
#include <cstdint>
#include <vector>

#include <glm/common.hpp>

#include "radiosity/detail/cluster_tree.h"
#include "radiosity/surface_mesh.h"

namespace daylit::radiosity {

class NearFacets {
public:
  explicit NearFacets(const SurfaceMesh& mesh) {
    for (const Facet& p : mesh.facets)
      box_[0].push_back({glm::min(p.corner[0], glm::min(p.corner[1], p.corner[2])),
                         glm::max(p.corner[0], glm::max(p.corner[1], p.corner[2]))});
    for (std::size_t level = 1; level < 3; ++level)
      for (std::uint32_t k = 0; k * kRun < box_[level - 1].size(); ++k) {
        Box all = box_[level - 1][k * kRun];
        for (std::uint32_t i = k * kRun; i < end(level, k); ++i)
          all = {glm::min(all.lo, box_[level - 1][i].lo), glm::max(all.hi, box_[level - 1][i].hi)};
        box_[level].push_back(all);
      }
  }

  /// Calls visit(facet) for every facet whose box is at most `reach_m` from that of `facet`; stops when it says false.
  template <class Visit>
  void visit(std::uint32_t facet, double reach_m, const Visit& visit) const {
    const Box& own = box_[0][facet];
    for (std::uint32_t top = 0; top < box_[2].size(); ++top)
      for (std::uint32_t run = first(2, top, own, reach_m); run < end(2, top); ++run)
        for (std::uint32_t p = first(1, run, own, reach_m); p < end(1, run); ++p)
          if (p != facet && distance(box_[0][p], own) <= reach_m && !visit(p))
            return;
  }

private:
  static constexpr std::uint32_t kRun = 16;
  std::uint32_t end(std::size_t level, std::uint32_t k) const {
    return std::min((k + 1) * kRun, static_cast<std::uint32_t>(box_[level - 1].size()));
  }
  /// The first child of box k of a level, or its end when the box is too far away.
  std::uint32_t first(std::size_t level, std::uint32_t k, const Box& own, double reach_m) const {
    return distance(box_[level][k], own) <= reach_m ? k * kRun : end(level, k);
  }

  std::vector<Box> box_[3]; ///< of facets, of runs of kRun, of runs of runs
};

} // namespace daylit::radiosity
