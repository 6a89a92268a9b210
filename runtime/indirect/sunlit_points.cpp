#include "runtime/indirect/sunlit_points.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/geometric.hpp>

#include "scene/room/aperture.h"

namespace daylit {

namespace {
constexpr std::size_t kMost = 128;
constexpr float kFar = std::numeric_limits<float>::infinity();

/// Of the area A cos that the sun sees on a surface with cosine `there`: its root.
double spacing(double area_m2, double there) { return std::sqrt(area_m2 / std::max(there, 0.05)); }

} // namespace

/// Power = rho tau E_normal A cos of the cell, divided by the windows in series, each of which has a cell for it.
std::vector<SunlitPoint> sunlit_points(const Room& room, const RayScene& rays, const RoomPlanes& planes,
                                       std::span<const Aperture> apertures, std::span<const ApertureCell> cells,
                                       const DetectedSun& sun) {
  std::vector<SunlitPoint> all;
  const std::vector<Aperture> panes(apertures.begin(), apertures.end());
  for (const ApertureCell& cell : cells) {
    const double cosine = -glm::dot(cell.inward, sun.direction);
    RayHit hit;
    const glm::vec3 from = rays.to_local(cell.centre), down(-sun.direction);
    if (cosine <= 0.0 || rays.occluded(from, -down, 0.0f, kFar) || !rays.closest(from, down, 0.0f, kFar, hit))
      continue;
    const glm::dvec3& n = planes[planes.facing_of(hit.triangle, -sun.direction)].normal;
    const glm::dvec3 x = cell.centre - static_cast<double>(hit.distance) * sun.direction + kAirGap_m * n;
    int crossed = 0;
    const Rgb pane = aperture_transmittance(panes, x, sun.direction, std::numeric_limits<double>::infinity(), &crossed);
    if (crossed > 0)
      all.push_back({x, n,
                     static_cast<float>(cosine * cell.area_m2 / crossed) * pane * sun.normal_irradiance *
                         room.material(room.triangles[hit.triangle]).reflectance,
                     spacing(cosine * cell.area_m2, glm::dot(n, sun.direction))});
  }
  const std::size_t step = (all.size() + kMost - 1) / kMost;
  std::vector<SunlitPoint> some;
  for (std::size_t k = 0; k < all.size(); k += step) {
    some.push_back(all[k]);
    some.back().power *= static_cast<float>(std::min(step, all.size() - k));
    some.back().spacing_m *= std::sqrt(static_cast<double>(step));
  }
  return some;
}

} // namespace daylit
