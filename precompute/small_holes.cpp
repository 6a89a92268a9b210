#include "precompute/small_holes.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "precompute/probes.h"
#include "scene/room/outlines.h"

namespace daylit::precompute {

namespace {

constexpr double kLargest_m = 0.3, kAir_m = 0.5; ///< across a hole; before and behind it
constexpr double kUpright = 0.99;                ///< |component| of the normal along an axis
constexpr std::array<double, 6> kBeside{0.03, 0.09, 0.16, 0.24, 0.33, 0.45},
    kBefore{0.05, 0.12, 0.2, 0.3, 0.42, 0.55}; ///< metres from the outline in its plane, and from the plane
constexpr double kWanted_m = 0.6;              ///< around the outline
constexpr double kSame_m = 0.02;               ///< so close a plane that is there already will do

} // namespace

std::vector<SmallHole> small_holes(const Room& room, const RayScene& rays, const std::vector<Aperture>& apertures) {
  std::vector<SmallHole> holes;
  for (const daylit::detail::Outline& o :
       daylit::detail::hole_outlines(room, daylit::detail::BorderKind::crease).outlines) {
    SmallHole hole{{}, o.normal};
    for (const glm::dvec3& c : o.corners)
      hole.box.include(c);
    const glm::dvec3 size = hole.box.size(), middle = hole.box.centre(), way = kAir_m * o.normal;
    if (std::max({size.x, size.y, size.z}) <= kLargest_m && open_between(middle - way, middle + way, rays, apertures))
      holes.push_back(hole);
  }
  return holes;
}

/// Steps of about the hole's own width, the width of the edges of light behind it.
void add_planes_near(const std::vector<SmallHole>& holes, Planes& planes) {
  for (const SmallHole& hole : holes) {
    if (std::max({std::abs(hole.normal.x), std::abs(hole.normal.y), std::abs(hole.normal.z)}) < kUpright)
      continue;
    const Bounds where{hole.box.min - kWanted_m, hole.box.max + kWanted_m};
    for (int axis = 0; axis < 3; ++axis)
      for (const double d : std::abs(hole.normal[axis]) > 0.5 ? kBefore : kBeside) {
        add_plane(planes[static_cast<std::size_t>(axis)], hole.box.min[axis] - d, kSame_m, where);
        add_plane(planes[static_cast<std::size_t>(axis)], hole.box.max[axis] + d, kSame_m, where);
      }
  }
  for (std::vector<ProbePlane>& along : planes)
    std::ranges::sort(along, {}, &ProbePlane::at);
}

} // namespace daylit::precompute
