#include "precompute/far_probes.h"

#include <algorithm>

#include "precompute/probes.h"
#include "scene/core/parallel.h"
#include "scene/volume/interpolated_probes.h"

namespace daylit::precompute {

namespace {

bool holds(const Bounds& box, const glm::dvec3& p) {
  for (int k = 0; k < 3; ++k)
    if (p[k] < box.min[k] || p[k] > box.max[k])
      return false;
  return true;
}

bool wanted(const ProbePlane& plane, const glm::dvec3& p) {
  const auto in = [&](const Bounds& box) { return holds(box, p); };
  return plane.where.empty() || std::ranges::any_of(plane.where, in) || std::ranges::any_of(plane.beside, in);
}

/// Visits the probes of the planes, x fastest: visit(index, position, plane of each axis).
template <class Visit>
void for_each_probe(const Planes& planes, const Visit& visit) {
  std::size_t i = 0;
  for (const ProbePlane& z : planes[2])
    for (const ProbePlane& y : planes[1])
      for (const ProbePlane& x : planes[0])
        visit(i++, glm::dvec3(x.at, y.at, z.at), std::array{&x, &y, &z});
}

} // namespace

/// Axis by axis: all that may be interpolated along it are taken out at first, then those whose way between their two
/// neighbours is not open are put back. A probe that is put back only makes such ways shorter.
void interpolate_far_probes(const Planes& planes, const RayScene& scene, const std::vector<Aperture>& apertures,
                            ProbeSet& grid) {
  grid.interpolated.assign(grid.size(), 0);
  const GridNeighbours neighbours(grid);
  const auto position = [&](std::size_t i) { return grid.origin + glm::dvec3(grid.positions[i]); };
  for (int axis = 0; axis < 3; ++axis) {
    const auto along = static_cast<std::uint8_t>(axis + 1);
    for_each_probe(planes, [&](std::size_t i, const glm::dvec3& p, const auto& of) {
      if (grid.valid[i] && grid.interpolated[i] == 0 && !wanted(*of[static_cast<std::size_t>(axis)], p))
        grid.interpolated[i] = along;
    });
    std::vector<std::uint8_t> closed(grid.size(), 0);
    parallel_for(std::size_t{0}, grid.size(), [&](std::size_t i) {
      if (grid.interpolated[i] == along) {
        const auto between = neighbours.between(i, axis);
        closed[i] = between && open_between(position(between->a), position(between->b), scene, apertures) ? 0 : 1;
      }
    });
    for (std::size_t i = 0; i < grid.size(); ++i)
      if (closed[i])
        grid.interpolated[i] = 0;
  }
  for (std::size_t i = 0; i < grid.size(); ++i)
    if (grid.interpolated[i])
      grid.valid[i] = 0;
  if (std::ranges::count(grid.interpolated, 0) == std::ssize(grid.interpolated))
    grid.interpolated.clear();
}

std::size_t probes_wanted(const Planes& planes) {
  std::size_t count = 0;
  for_each_probe(planes, [&](std::size_t, const glm::dvec3& p, const auto& of) {
    count += std::ranges::all_of(of, [&](const ProbePlane* plane) { return wanted(*plane, p); }) ? 1 : 0;
  });
  return count;
}

} // namespace daylit::precompute
