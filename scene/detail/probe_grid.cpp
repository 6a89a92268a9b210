#include "scene/detail/probe_grid.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

namespace daylit::detail {

namespace {
constexpr double kGridShare = 1e-3; // of the spacing: how far a probe may be from its grid position
}

Result<void> check_grid(const ProbeSet& probes) {
  const auto error = [](const char* what) {
    return Error{ErrorCode::file_malformed, what, "probe grid", "bake the volume again"};
  };
  const glm::ivec3 n = probes.count;
  const auto total = static_cast<double>(n.x) * n.y * n.z;
  if (n.x < 1 || n.y < 1 || n.z < 1 || total != static_cast<double>(probes.size()))
    return error("the counts do not multiply to the number of probes");
  for (int k = 0; k < 3; ++k)
    if (n[k] > 1 && !(probes.spacing[k] > 0.0 && std::isfinite(probes.spacing[k])))
      return error("the spacing is not positive");
  const double largest = std::max({probes.spacing.x, probes.spacing.y, probes.spacing.z});
  std::size_t i = 0;
  for (int z = 0; z < n.z; ++z)
    for (int y = 0; y < n.y; ++y)
      for (int x = 0; x < n.x; ++x, ++i) {
        const glm::dvec3 expected = glm::dvec3(probes.positions[0]) + probes.spacing * glm::dvec3(x, y, z);
        if (probes.size() > 1 && !(glm::distance(expected, glm::dvec3(probes.positions[i])) <= kGridShare * largest))
          return error("a probe is not where the grid says");
      }
  return {};
}

} // namespace daylit::detail
