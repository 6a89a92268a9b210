#pragma once

// The direct light of one frame: M directional lights that carry visibility, and a fine quadrature of the apertures
// that carries the unshadowed energy.
//
// At a point x with normal n the direct sky irradiance is estimated as E_open(x, n) * sum_j e_j V_j / sum_j e_j, with
// e_j = irradiance_j max(0, n.w_j) T_j(x), T_j = transmittance of the aperture that the ray x + t w_j crosses (0: none)
// and V_j the visibility past real and virtual geometry. E_open is integrated over the aperture cells, so the M samples
// only decide which fraction of it is blocked: an unblocked point is free of sampling error (a ratio estimator of
// equation 7 in Grosch et al. 2007, which has sum_j e_j V_j alone).

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include "runtime/sky/sky_map.h"
#include "runtime/sky/window_cone.h"
#include "scene/sky/sun.h"
#include "scene/volume/volume.h"

namespace daylit {

struct DirectionalLight {
  glm::dvec3 direction{0.0, 0.0, 1.0}; ///< unit, towards the light
  Rgb irradiance{0.0f};                ///< on a plane facing it, before panes
};

struct LightSet {
  std::vector<DirectionalLight> sky; ///< importance samples of the sky without its sun
  std::vector<DirectionalLight> sun; ///< even samples of the sun's disc, exact energy in sum; empty: no sun reaches
  bool sun_found = false;            ///< a sun is in the image, whether or not it reaches the object
  std::size_t size() const { return sky.size() + sun.size(); }
};

/// `budget` lights in all, of which the sun, when its light can reach the sphere, gets a quarter (at least one).
LightSet sample_lights(const SkyMap& map, const std::optional<DetectedSun>& sun, std::span<const Aperture> apertures,
                       const BoundingSphere& sphere, int budget);

/// Small facet of an aperture, seen from inside.
struct ApertureCell {
  glm::dvec3 centre{0.0};              ///< world metres
  glm::dvec3 inward{0.0};              ///< unit
  glm::dvec3 side_a{0.0}, side_b{0.0}; ///< of it as a parallelogram, metres
  double area_m2 = 0.0;
  int level = 0;           ///< of the sky pyramid, whose texels are about as large as the cell seen from the object
  Rgb transmittance{1.0f}; ///< of all apertures that a ray from the object through this cell crosses, divided by
                           ///< their number: panes in series divide the light instead of counting it twice
  float refractive_index = 0.0f; ///< clear glass: its slab comes on top, at the angle of each ray; 0 behind a second
                                 ///< pane, where transmittance holds it as seen from the object
  bool operator==(const ApertureCell&) const = default;
};

constexpr double kCellFraction = 0.125; ///< of the distance to what is lit: how wide window cells are
/// Cells no wider than about that fraction of the distance to the sphere, at most 24 x 24 per quadrilateral and with
/// kCellFraction at least 6 x 6, with twice it 3 x 3.
std::vector<ApertureCell> aperture_cells(std::span<const Aperture> apertures, const BoundingSphere& sphere,
                                         std::span<const SkyMap> pyramid, double fraction = kCellFraction);

/// Its four quarters.
std::array<ApertureCell, 4> quarters(const ApertureCell& cell);

/// Squared distance from its middle up to which the cell is close: there its middle does not stand for all of it.
inline double close2(const ApertureCell& cell) {
  return 4.0 * std::max(glm::dot(cell.side_a, cell.side_a), glm::dot(cell.side_b, cell.side_b));
}
/// Unshadowed irradiance through one cell, cut in four as long as its parts are close, at x with unit normal n.
Rgb irradiance_through(const ApertureCell& cell, std::span<const SkyMap> pyramid, const glm::dvec3& x,
                       const glm::dvec3& n);
/// `pyramid`: sky_map_pyramid(). Unshadowed irradiance from the sky through the apertures at x with unit normal n.
Rgb open_sky_irradiance(std::span<const SkyMap> pyramid, std::span<const ApertureCell> cells, const glm::dvec3& x,
                        const glm::dvec3& n);
/// The same for many points, in parallel and single precision: within 1e-4 of it.
std::vector<Rgb> open_sky_irradiance(std::span<const SkyMap> pyramid, std::span<const ApertureCell> cells,
                                     std::span<const glm::dvec3> x, std::span<const glm::vec3> n);

/// The cells as directional lights at x.
std::vector<DirectionalLight> window_lights(std::span<const SkyMap> pyramid, std::span<const ApertureCell> cells,
                                            const glm::dvec3& x);

} // namespace daylit
