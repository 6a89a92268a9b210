#pragma once

// Visibility queries against triangles: a thin, value-like wrapper around Embree (ROBUST mode, BVH in float).
// Geometry is re-centred on build, so a room 1e6 m from the origin loses nothing.

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "scene/core/result.h"
#include "scene/room/room.h"

namespace daylit {

struct RayHit {
  std::uint32_t triangle = 0; ///< index into the triangle list given at construction
  float distance = 0.0f;      ///< metres along a unit direction
  float u = 0.0f, v = 0.0f;   ///< barycentric weights of corners 1 and 2
};

/// Rays of one packet, structure of arrays, coordinates relative to RayScene::origin().
struct alignas(64) RayPacket16 {
  float org_x[16], org_y[16], org_z[16], tnear[16];
  float dir_x[16], dir_y[16], dir_z[16];
  float tfar[16];

  void set(std::size_t ray, const glm::vec3& origin, const glm::vec3& direction, float near, float far) {
    org_x[ray] = origin.x, org_y[ray] = origin.y, org_z[ray] = origin.z;
    dir_x[ray] = direction.x, dir_y[ray] = direction.y, dir_z[ray] = direction.z;
    tnear[ray] = near, tfar[ray] = far;
  }
  glm::vec3 direction(std::size_t ray) const { return {dir_x[ray], dir_y[ray], dir_z[ray]}; }
};

/// First hits of a packet; `triangle`, `distance`, `u`, `v` as in RayHit.
struct alignas(64) RayHits16 {
  std::uint32_t triangle[16];
  float distance[16], u[16], v[16];
};

class RayScene {
public:
  /// Triangles as index triples into vertices (metres). Thread-safe for queries once built.
  static Result<RayScene> build(std::span<const glm::dvec3> vertices,
                                std::span<const std::array<std::uint32_t, 3>> triangles);
  /// The reflecting surfaces of a room: everything except window panes. `triangle` of a hit indexes room.triangles.
  static Result<RayScene> build(const Room& room);

  /// Added to every local coordinate to get world metres.
  const glm::dvec3& origin() const { return origin_; }
  glm::vec3 to_local(const glm::dvec3& world) const { return glm::vec3(world - origin_); }

  /// Closest hit on [tnear, tfar]; `local_origin` from to_local(), `direction` need not be unit (distance scales).
  bool closest(const glm::vec3& local_origin, const glm::vec3& direction, float tnear, float tfar, RayHit& hit) const;
  bool occluded(const glm::vec3& local_origin, const glm::vec3& direction, float tnear, float tfar) const;
  /// Bit k of the result: ray k of `count` <= 16 is blocked. The packet is not changed.
  std::uint32_t occluded16(const RayPacket16& rays, int count) const;
  /// Bit k of the result: ray k of `count` <= 16 hits something, first of all triangle[k].
  std::uint32_t closest16(const RayPacket16& rays, int count, std::array<std::uint32_t, 16>& triangle) const;
  /// The same with all of the hits; those of other rays are not written.
  std::uint32_t closest16(const RayPacket16& rays, int count, RayHits16& hits) const;

  /// Distance to the nearest triangle, metres; `within` where none is nearer. `local` from to_local().
  float distance(const glm::vec3& local, float within) const;

  /// Triangles no further than `distance` (metres) from a point, in ascending order. `local` from to_local().
  std::vector<std::uint32_t> triangles_within(const glm::vec3& local, float distance) const;

  /// Smallest safe ray offset: float rounding of the coordinates at this scene's extent, metres.
  float surface_offset() const { return surface_offset_; }

private:
  struct Handle;
  std::shared_ptr<const Handle> handle_;
  glm::dvec3 origin_{0.0};
  float surface_offset_ = 1e-5f;
  std::vector<std::uint32_t> source_triangle_;
};

} // namespace daylit
