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
constexpr std::array<double, 8> kBeside{0.03, 0.08, 0.13, 0.19, 0.25, 0.32, 0.4, 0.5},
    kBefore{0.05, 0.1,  0.16, 0.22,
            0.29, 0.37, 0.46, 0.56}; ///< metres from the outline in its plane, and from the plane
constexpr double kWanted_m = 0.6;    ///< around the outline
constexpr double kSame_m = 0.02;     ///< so close a plane that is there already will do

} // namespace

std::vector<SmallHole> small_holes(const Room& room, const RayScene& rays, const std::vector<Aperture>& apertures) {
  std::vector<SmallHole> holes;
  for (const daylit::detail::Outline& o :
       daylit::detail::hole_outlines(room, daylit::detail::BorderKind::crease).outlines) {
    SmallHole hole{o.corners, {}, o.normal};
    for (const glm::dvec3& c : o.corners)
      hole.box.include(c);
    const glm::dvec3 size = hole.box.size(), middle = hole.box.centre(), way = kAir_m * o.normal;
    if (std::max({size.x, size.y, size.z}) <= kLargest_m && open_between(middle - way, middle + way, rays, apertures))
      holes.push_back(hole);
  }
  return holes;
}

std::vector<radiosity::HoleOutline> convex_outlines(const std::vector<SmallHole>& holes, const glm::dvec3& origin) {
  std::vector<radiosity::HoleOutline> outlines;
  for (const SmallHole& hole : holes)
    for (const daylit::detail::Outline& part : daylit::detail::convex_parts({hole.corners, hole.normal})) {
      radiosity::HoleOutline& corners = outlines.emplace_back();
      for (const glm::dvec3& c : part.corners)
        corners.push_back(c - origin);
    }
  return outlines;
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
