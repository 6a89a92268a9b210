#pragma once

// What a bake is judged by: points off the grid and skies that it does not use, carried through the same transport as
// further right-hand sides and further receivers.

#include <span>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include "radiosity/first_bounce.h"
#include "scene/core/result.h"
#include "scene/room/ray_scene.h"
#include "scene/room/room.h"
#include "scene/sky/sky_partition.h"

namespace daylit::precompute {

/// A sky that is no sum of the bake's regions. Radiance per region of held_out_partition(), grey.
struct HeldOutSky {
  std::string name;
  bool is_sun = false;
  std::vector<float> radiance;
  bool of_room = false; ///< a sun that stands where it counts in one of several rooms
};

/// Regions of 5 degrees, and three bands of half a degree whose cells are suns at 9, 23 and 42 degrees of altitude.
const SkyPartition& held_out_partition();

/// Smooth skies: uniform, CIE overcast over a darker ground, a slope across the sky, a glow at the horizon.
const std::vector<HeldOutSky>& smooth_skies();

/// Suns of half a degree, `of_band` for each band that lights the room at all: spread evenly over the band's light, so
/// that they stand where suns count. `light`: of held_out_partition(), element by element; `weight`: what an element's
/// light counts, per unit of irradiance.
std::vector<HeldOutSky> suns(std::span<const radiosity::FirstBounceRow> light, std::span<const double> weight,
                             int of_band);

/// Direct light of the skies: column s is sky s.
radiosity::FirstBounce direct_light(std::span<const radiosity::FirstBounceRow> light,
                                    std::span<const HeldOutSky> skies);

/// What a sky puts on the regions or nodes of another partition: mean radiance per region, or the integral with the
/// hat functions over the solid angle of the node.
std::vector<float> radiance_on(const SkyPartition& partition, const HeldOutSky& sky);

/// Candidates for points, spread evenly (R3 sequence, Roberts 2018) over the bounds: those at least
/// `clearance` away from all surfaces and apertures. Bounds and room in any one unit.
std::vector<glm::dvec3> spread_points(const Room& room, const Bounds& bounds, std::size_t count, double clearance);

} // namespace daylit::precompute
