#include "runtime/sky/direct_light.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

#include "runtime/sky/window_sampler.h"
#include "scene/room/aperture.h"
#include "scene/room/glass.h"

namespace daylit {

namespace {

constexpr int kMinDivisions = 6; // with kCellFraction
constexpr int kMaxDivisions = 24;
constexpr int kCellBudget = 1000; // in all; what the shaders hold
constexpr int kMostCuts = 8;      // of a close cell
constexpr double kMost_sr = 0.25; // that a part may seem to fill: closer to its middle it is not a point

/// `count` directions over the disc, each with E / count; none when the disc misses the portal clip planes.
std::vector<DirectionalLight> sample_sun(const DetectedSun& sun, const WindowCone& cone, int count) {
  std::vector<DirectionalLight> lights;
  if (!cone.allows(sun.direction, kSunAngularRadius))
    return lights;
  for (int k = 0; k < count; ++k)
    lights.push_back({sun_disc_direction(sun.direction, k, count), sun.normal_irradiance / static_cast<float>(count)});
  return lights;
}

struct Patch {
  glm::dvec3 corner, side_a, side_b; ///< parallelogram-like: bilinear over a quad, collapsed for a triangle
  glm::dvec3 twist;
};

/// Level whose texels have about the solid angle Omega: 1/2 log2(Omega / Omega_0), for a level's texels have four times
/// the solid angle of those before.
int pyramid_level(std::span<const SkyMap> pyramid, const glm::dvec3& w, double solid_angle_sr) {
  const int row = std::min(static_cast<int>(pyramid[0].position(w).y), pyramid[0].height - 1);
  const double ratio = std::max(solid_angle_sr, 1e-12) / pyramid[0].solid_angle_sr(row);
  return static_cast<int>(std::clamp(std::lround(0.5 * std::log2(ratio)), 0L, static_cast<long>(pyramid.size()) - 1));
}

/// A convex polygon as quadrilaterals (fan of two triangles at a time; a last triangle has a zero side).
std::vector<Patch> quadrilaterals(const Aperture& a) {
  std::vector<Patch> patches;
  const std::size_t n = a.corners.size();
  for (std::size_t k = 1; k + 1 < n; k += 2) {
    const glm::dvec3 p0 = a.corners[0], p1 = a.corners[k], p2 = a.corners[k + 1],
                     p3 = k + 2 < n ? a.corners[k + 2] : a.corners[0];
    patches.push_back({p0, p1 - p0, p3 - p0, p0 - p1 + p2 - p3});
  }
  return patches;
}

/// Transmittance of the cell's pane and glass slab at this angle of incidence (scene/room/glass.h).
Rgb through(const ApertureCell& cell, double cos_incidence) {
  return pane_transmittance(cell.transmittance, cell.refractive_index, cos_incidence);
}

/// The midpoints (s, t) of a regular division of the bilinear patch x(s, t); the area element is |dx/ds x dx/dt| ds dt.
void append_cells(const Patch& patch, const Aperture& aperture, int divisions, std::vector<ApertureCell>& cells) {
  for (int i = 0; i < divisions; ++i)
    for (int j = 0; j < divisions; ++j) {
      const double s = (i + 0.5) / divisions, t = (j + 0.5) / divisions;
      const glm::dvec3 ds = patch.side_a + t * patch.twist, dt = patch.side_b + s * patch.twist;
      const double area = glm::length(glm::cross(ds, dt)) / (divisions * divisions);
      if (area > 0.0)
        cells.push_back({patch.corner + s * patch.side_a + t * patch.side_b + s * t * patch.twist, aperture.inward,
                         ds / double(divisions), dt / double(divisions), area, 0, aperture.transmittance,
                         aperture.refractive_index});
    }
}

} // namespace

/// Sky lights estimate equation 7 of Grosch et al. 2007: E_j = L(w_j) / (M p(w_j)), with w_j from a low-discrepancy
/// set. The sun is sampled apart: one sample of the sky in its disc would carry all of its variance.
LightSet sample_lights(const SkyMap& map, const std::optional<DetectedSun>& sun, std::span<const Aperture> apertures,
                       const BoundingSphere& sphere, int budget) {
  LightSet lights;
  const WindowCone cone(apertures, sphere);
  if (sun) {
    lights.sun_found = true;
    lights.sun = sample_sun(*sun, cone, std::max(budget / 4, 1));
  }
  const WindowSampler sampler(map, cone);
  const int count = std::max(budget - static_cast<int>(lights.sun.size()), 1);
  for (int j = 0; !sampler.empty() && j < count; ++j) {
    const WindowSample s = sampler.sample_window(lattice_point(j, count));
    lights.sky.push_back({s.direction, s.radiance * static_cast<float>(1.0 / (s.pdf * count))});
  }
  return lights;
}

/// Divisions of a patch: its side by that fraction of the distance to the sphere. The transmittance of several panes
/// in series is that of all, divided among them by their number.
std::vector<ApertureCell> aperture_cells(std::span<const Aperture> apertures, const BoundingSphere& sphere,
                                         std::span<const SkyMap> pyramid, double fraction) {
  std::vector<ApertureCell> cells;
  std::size_t patches = 0;
  for (const Aperture& a : apertures)
    patches += (a.corners.size() - 1) / 2;
  const double most =
      std::max(std::floor(std::sqrt(kCellBudget / static_cast<double>(std::max(patches, std::size_t{1})))), 1.0);
  for (const Aperture& a : apertures)
    for (const Patch& patch : quadrilaterals(a)) {
      const glm::dvec3 middle = patch.corner + 0.5 * (patch.side_a + patch.side_b) + 0.25 * patch.twist;
      const double size =
          std::max(glm::length(patch.side_a + 0.5 * patch.twist), glm::length(patch.side_b + 0.5 * patch.twist));
      const double distance = std::max(glm::length(middle - sphere.centre) - 0.5 * size - sphere.radius, 0.05);
      const int divisions = static_cast<int>(std::clamp(std::ceil(size / (fraction * distance)),
                                                        std::min(kMinDivisions * kCellFraction / fraction, most),
                                                        std::min(double{kMaxDivisions}, most)));
      append_cells(patch, a, divisions, cells);
    }
  const std::vector<Aperture> list(apertures.begin(), apertures.end());
  for (ApertureCell& cell : cells) {
    int crossed = 0;
    const glm::dvec3 to_cell = cell.centre - sphere.centre;
    const double distance = glm::length(to_cell);
    if (distance <= 0.0)
      continue;
    const double seen_sr = std::fabs(glm::dot(cell.inward, to_cell)) / distance * cell.area_m2 / (distance * distance);
    cell.level = pyramid_level(pyramid, to_cell / distance, seen_sr);
    const Rgb all = aperture_transmittance(list, sphere.centre, to_cell / distance,
                                           std::numeric_limits<double>::infinity(), &crossed);
    if (crossed > 1) {
      cell.transmittance = all / static_cast<float>(crossed);
      cell.refractive_index = 0.0f;
    }
  }
  return cells;
}

std::array<ApertureCell, 4> quarters(const ApertureCell& cell) {
  std::array<ApertureCell, 4> parts;
  parts.fill(cell);
  for (std::size_t k = 0; k < 4; ++k) {
    parts[k].side_a *= 0.5;
    parts[k].side_b *= 0.5;
    parts[k].area_m2 *= 0.25;
    parts[k].centre += (k >> 1 ? 0.5 : -0.5) * parts[k].side_a + (k & 1 ? 0.5 : -0.5) * parts[k].side_b;
  }
  return parts;
}

namespace {

/// E(x, n) of one cell = L(w) tau cos_cell cos_receiver A / r^2: the form factor of a small facet (Cohen & Wallace
/// 1993, ch. 4) times pi, by its middle.
Rgb through_middle(const ApertureCell& cell, const SkyMap& map, const glm::dvec3& x, const glm::dvec3& n) {
  const glm::dvec3 d = cell.centre - x;
  const double r2 = glm::dot(d, d), r = std::sqrt(r2);
  const double facing = -glm::dot(cell.inward, d), receiving = glm::dot(n, d);
  if (facing <= 0.0 || receiving <= 0.0)
    return Rgb(0.0f);
  const double projected_sr = std::min(facing * receiving * cell.area_m2 / (r2 * r2), kMost_sr);
  return static_cast<float>(projected_sr) * through(cell, facing / r) * Rgb(map.interpolate(d / r));
}

bool is_close(const ApertureCell& cell, const glm::dvec3& x) {
  const glm::dvec3 d = cell.centre - x;
  return glm::dot(d, d) < close2(cell);
}

Rgb through_parts(const ApertureCell& cell, std::span<const SkyMap> pyramid, const glm::dvec3& x, const glm::dvec3& n,
                  int cuts) {
  if (cuts == 0 || !is_close(cell, x)) {
    const glm::dvec3 d = cell.centre - x;
    const double r2 = std::max(glm::dot(d, d), 1e-12);
    const int level = pyramid_level(pyramid, d / std::sqrt(r2),
                                    std::fabs(glm::dot(cell.inward, d)) * cell.area_m2 / (r2 * std::sqrt(r2)));
    return through_middle(cell, pyramid[static_cast<std::size_t>(level)], x, n);
  }
  Rgb sum(0.0f);
  for (const ApertureCell& part : quarters(cell))
    sum += through_parts(part, pyramid, x, n, cuts - 1);
  return sum;
}

} // namespace

Rgb irradiance_through(const ApertureCell& cell, std::span<const SkyMap> pyramid, const glm::dvec3& x,
                       const glm::dvec3& n) {
  return is_close(cell, x) ? through_parts(cell, pyramid, x, n, kMostCuts)
                           : through_middle(cell, pyramid[static_cast<std::size_t>(cell.level)], x, n);
}

Rgb open_sky_irradiance(std::span<const SkyMap> pyramid, std::span<const ApertureCell> cells, const glm::dvec3& x,
                        const glm::dvec3& n) {
  glm::dvec3 sum(0.0);
  for (const ApertureCell& cell : cells)
    sum += glm::dvec3(irradiance_through(cell, pyramid, x, n));
  return Rgb(sum);
}

/// E_cell on a plane that faces the cell = L(w) tau cos_cell A / r^2.
std::vector<DirectionalLight> window_lights(std::span<const SkyMap> pyramid, std::span<const ApertureCell> cells,
                                            const glm::dvec3& x) {
  std::vector<DirectionalLight> lights;
  for (const ApertureCell& cell : cells) {
    const glm::dvec3 d = cell.centre - x;
    const double r = glm::length(d), facing = -glm::dot(cell.inward, d);
    if (facing > 0.0)
      lights.push_back({d / r, static_cast<float>(facing * cell.area_m2 / (r * r * r)) * through(cell, facing / r) *
                                   pyramid[cell.level].interpolate(d / r)});
  }
  return lights;
}

} // namespace daylit
