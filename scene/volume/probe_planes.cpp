#include "scene/volume/probe_planes.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

#include "scene/volume/volume.h"

namespace daylit {

namespace {

constexpr double kGridTolerance = 1e-3; // of the spacing: how far a probe may be from its grid position

Error error(const char* what) { return {ErrorCode::file_malformed, what, "probe grid", "bake the volume again"}; }

/// As many planes as probes, increasing; their mean distance is the spacing that the file states.
Result<void> check_planes(const std::vector<double>& planes, int count, double spacing) {
  if (planes.size() != static_cast<std::size_t>(count))
    return error("there are not as many coordinates along an axis as probes");
  if (!std::ranges::all_of(planes, [](double x) { return std::isfinite(x); }))
    return error("a coordinate of the grid is not finite");
  if (std::ranges::adjacent_find(planes, [](double a, double b) { return !(a < b); }) != planes.end())
    return error("the coordinates of the grid do not increase");
  if (count > 1 && !(std::abs(planes.back() - planes.front() - spacing * (count - 1)) <= kGridTolerance * spacing))
    return error("the spacing is not the mean distance of the coordinates");
  return {};
}

} // namespace

/// Plane i of a regular grid is at position[0] + i spacing.
ProbePlanes::ProbePlanes(const ProbeSet& grid) : origin_(grid.origin), plane_(grid.planes) {
  if (grid.is_graded())
    return;
  for (int k = 0; k < 3; ++k)
    for (int i = 0; i < grid.count[k]; ++i)
      plane_[static_cast<std::size_t>(k)].push_back(static_cast<double>(grid.positions[0][k]) + grid.spacing[k] * i);
}

int ProbePlanes::below(int axis, double world_m) const {
  const std::vector<double>& planes = along(axis);
  return static_cast<int>(std::ranges::upper_bound(planes, world_m - origin_[axis]) - planes.begin()) - 1;
}

/// Along each axis, with planes x_i <= x < x_{i+1}: cell i and fraction (x - x_i) / (x_{i+1} - x_i).
GridPosition ProbePlanes::locate(const glm::dvec3& p) const {
  GridPosition at;
  for (int k = 0; k < 3; ++k) {
    const std::vector<double>& planes = along(k);
    const double x = p[k] - origin_[k], inside = std::clamp(x, planes.front(), planes.back());
    at.clamped = at.clamped || inside != x;
    if (planes.size() < 2)
      continue;
    at.cell[k] = std::clamp(below(k, p[k]), 0, static_cast<int>(planes.size()) - 2);
    const double *low = planes.data() + at.cell[k], *high = low + 1;
    at.fraction[k] = (inside - *low) / (*high - *low);
  }
  return at;
}

/// Probe (x, y, z) is number x + count.x (y + count.y z) and stands where plane x, y and z meet, within kGridTolerance.
Result<void> check_grid(const ProbeSet& probes) {
  const glm::ivec3 n = probes.count;
  const auto total = static_cast<double>(n.x) * n.y * n.z;
  if (n.x < 1 || n.y < 1 || n.z < 1 || total != static_cast<double>(probes.size()))
    return error("the counts do not multiply to the number of probes");
  for (int k = 0; k < 3; ++k) {
    if (n[k] > 1 && !(probes.spacing[k] > 0.0 && std::isfinite(probes.spacing[k])))
      return error("the spacing is not positive");
    if (probes.is_graded())
      if (const Result<void> good = check_planes(probes.planes[static_cast<std::size_t>(k)], n[k], probes.spacing[k]);
          !good)
        return good;
  }
  const double largest = std::max({probes.spacing.x, probes.spacing.y, probes.spacing.z});
  const ProbePlanes planes(probes);
  std::size_t i = 0;
  for (int z = 0; z < n.z; ++z)
    for (int y = 0; y < n.y; ++y)
      for (int x = 0; x < n.x; ++x, ++i) {
        const glm::dvec3 expected(planes.along(0)[static_cast<std::size_t>(x)],
                                  planes.along(1)[static_cast<std::size_t>(y)],
                                  planes.along(2)[static_cast<std::size_t>(z)]);
        if (probes.size() > 1 &&
            !(glm::distance(expected, glm::dvec3(probes.positions[i])) <= kGridTolerance * largest))
          return error("a probe is not where the grid says");
      }
  return {};
}

} // namespace daylit
