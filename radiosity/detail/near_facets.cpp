#include "radiosity/detail/near_facets.h"

#include <glm/common.hpp>

namespace daylit::radiosity {

NearFacets::NearFacets(const SurfaceMesh& mesh) {
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

} // namespace daylit::radiosity
