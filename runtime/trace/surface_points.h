#pragma once

#include <algorithm>
#include <cmath>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "runtime/trace/traced_scene.h"
#include "runtime/trace/visible_surfaces.h"

namespace daylit {

/// How far above an object's surface shadow rays start, metres.
float start_offset(const TracedScene& scene);
/// The point of an object that a pixel shows, with its shading normal on the side that is seen.
PixelSurface object_surface(const TracedScene& scene, const glm::vec3& eye, const ObjectHit& hit);
/// `triangle`: of the room's ray scene.
PixelSurface room_surface(const TracedScene& scene, const glm::vec3& eye, std::uint32_t triangle,
                          const glm::vec3& position, bool receives);

/// What a pixel shows of a surface: a parallelogram around its point, lifted off a hollow one by `bend`.
struct PixelFootprint {
  glm::vec3 right{0.0f}, down{0.0f}; ///< to the next pixels, along the surface, metres
  glm::vec3 bend{0.0f};              ///< how far the surface is off its tangent plane there

  /// From the middle to the place (x, y) of the pixel, each -0.5 to 0.5: never below the surface.
  glm::vec3 step(const glm::vec2& place) const {
    return place.x * right + place.y * down + std::max(std::abs(place.x), std::abs(place.y)) * bend;
  }
};
/// Of the plane through the point x that a pixel shows; at most kMostStretched times as long as seen face on.
PixelFootprint room_footprint(const VisibleSurfaces& view, const glm::vec3& x, const glm::vec3& normal,
                              const glm::ivec2& pixel);
constexpr float kMostStretched = 8.0f;
/// Of an object, towards its points in the pixels around; zero towards edges of what is seen and across creases.
PixelFootprint object_footprint(const TracedScene& scene, const VisibleSurfaces& view, const glm::vec3& x,
                                const glm::vec3& normal, const glm::ivec2& pixel);

} // namespace daylit
