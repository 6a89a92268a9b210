#pragma once

// Arithmetic on sixteen points, or sixteen lights, at once: one source, compiled for several instruction sets.

#include <span>

#include <glm/mat3x3.hpp>

#include "runtime/shading/portal_lights.h"

namespace daylit::lanes {

/// PortalLights::received() for direction w.
LaneMask receive(const PointBlock& points, const glm::vec3& w, std::span<const Portal> portals, const glm::vec4* planes,
                 LaneRgb& e);

/// Lanes with n.w > 0.
LaneMask facing(const PointBlock& points, const glm::vec3& w);
/// Those of them whose ray along w meets the box (slab test: Kay and Kajiya 1986).
LaneMask facing_through_box(const PointBlock& points, const glm::vec3& w, const glm::vec3& low, const glm::vec3& high);

/// Of sixteen lights: which a point with normal n faces, and of which its ray meets a sphere.
struct FacedLights {
  LaneMask facing = 0, through_sphere = 0;
};
FacedLights faced_lights(const DirectionBlock& w, const glm::vec3& n, const glm::vec3& to_centre, float radius);

/// Sums over lights of irradiance: with nothing in the way, past the room, and past room and objects.
struct LightSums {
  LaneRgb unblocked, past_room, past_both;
};
/// Adds irradiance x e; the lanes of `by_room` lose it to the room, those of `by_any` to the room or an object.
void add_light(LightSums& sums, const Rgb& irradiance, const LaneRgb& e, LaneMask by_room, LaneMask by_any);

/// Bit k of masks[j] becomes bit j of bits[k]; at most 64 masks.
void transpose(std::span<const LaneMask> masks, std::uint64_t (&bits)[kLanes]);

/// to = origin + axes * from, of arrays of kLanes.
struct LaneVectors {
  const float *x, *y, *z;
};
void transform(const glm::mat3& axes, const glm::vec3& origin, const LaneVectors& from, float* x, float* y, float* z);

} // namespace daylit::lanes
