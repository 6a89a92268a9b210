#include "runtime/trace/shadow_sums.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/geometric.hpp>

#define DAYLIT_LANE_CLONES __attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")))

namespace daylit {

namespace {

// Surfaces nearer than this to a point of the room are taken to be its own, metres.
constexpr float kOwnSurface_m = 2e-4f;

void aim(RayBlock& rays, const PointBlock& from, float tnear) {
  std::copy(from.x, from.x + kLanes, rays.org_x);
  std::copy(from.y, from.y + kLanes, rays.org_y);
  std::copy(from.z, from.z + kLanes, rays.org_z);
  std::fill(rays.tnear, rays.tnear + kLanes, tnear);
  std::fill(rays.tfar, rays.tfar + kLanes, std::numeric_limits<float>::infinity());
}

void turn(RayBlock& rays, const glm::vec3& w) {
  std::fill(rays.dir_x, rays.dir_x + kLanes, w.x);
  std::fill(rays.dir_y, rays.dir_y + kLanes, w.y);
  std::fill(rays.dir_z, rays.dir_z + kLanes, w.z);
}

/// sums[c] += irradiance[c] * e[c] where the lane's bit is clear in `blocked`.
DAYLIT_LANE_CLONES
void add(float (&sums)[3][kLanes], const Rgb& irradiance, const float (&e)[3][kLanes], std::uint32_t blocked) {
  for (int k = 0; k < kLanes; ++k) {
    const float open = (blocked >> k & 1u) ? 0.0f : 1.0f;
    sums[0][k] += irradiance.r * e[0][k] * open;
    sums[1][k] += irradiance.g * e[1][k] * open;
    sums[2][k] += irradiance.b * e[2][k] * open;
  }
}

/// Lanes whose ray along w meets the casters' sphere.
DAYLIT_LANE_CLONES
std::uint32_t lanes_near(const PointBlock& p, const glm::vec3& w, const glm::vec3& centre, float radius) {
  alignas(64) int near[kLanes];
  for (int k = 0; k < kLanes; ++k) {
    const float x = centre.x - p.x[k], y = centre.y - p.y[k], z = centre.z - p.z[k];
    const float along = x * w.x + y * w.y + z * w.z, square = x * x + y * y + z * z - along * along;
    near[k] = (along > -radius) & (square < radius * radius);
  }
  std::uint32_t lanes = 0;
  for (int k = 0; k < kLanes; ++k)
    lanes |= static_cast<std::uint32_t>(near[k]) << k;
  return lanes & p.lanes;
}

bool block_near(const PointBlock& p, const glm::vec3& w, const ShadowCasters& casters) {
  const glm::vec3 d = casters.centre - p.centre;
  const float reach = casters.radius + p.radius, along = glm::dot(d, w);
  return along > -reach && glm::dot(d, d) - along * along < reach * reach;
}

} // namespace

bool may_be_shadowed(const LightCone& cone, const ShadowCasters& casters, const glm::vec3& centre, float radius) {
  if (cone.half_angle < 0.0f || casters.radius <= 0.0f)
    return false;
  const glm::vec3 d = casters.centre - centre;
  const float distance = glm::length(d), reach = casters.radius + radius;
  if (distance <= reach)
    return true;
  const float angle = cone.half_angle + std::asin(reach / distance);
  return angle >= 3.14159f || glm::dot(cone.axis, d) >= distance * std::cos(angle);
}

void sum_on_objects(const LightGates& lights, const ShadowCasters& casters, const PointBlock& points,
                    const PointBlock& origins, LaneSums& sums, std::uint64_t& rays) {
  RayBlock block;
  aim(block, origins, 0.0f);
  alignas(64) float e[3][kLanes];
  for (std::size_t j = 0; j < lights.size(); ++j) {
    const std::uint32_t lit = lights.received(j, points, e);
    if (lit == 0)
      continue;
    turn(block, lights.direction(j));
    std::uint32_t blocked = casters.objects->occluded(lit, block);
    blocked |= casters.occluders->occluded(lit & ~blocked, block);
    rays += static_cast<std::uint64_t>(__builtin_popcount(lit));
    add(sums.unblocked, lights.irradiance(j), e, 0);
    add(sums.past_both, lights.irradiance(j), e, blocked);
  }
}

void find_lost_lights(const LightGates& lights, const ShadowCasters& casters, const PointBlock& points,
                      LostLights& lost, std::uint64_t& rays) {
  lost.entries.clear();
  lost.lanes = 0;
  RayBlock block;
  bool aimed = false;
  alignas(64) float e[3][kLanes];
  for (std::size_t j = 0; j < lights.size(); ++j) {
    const glm::vec3& w = lights.direction(j);
    if (!block_near(points, w, casters))
      continue;
    const std::uint32_t near = lanes_near(points, w, casters.centre, casters.radius);
    const std::uint32_t lit = near ? near & lights.received(j, points, e) : 0u;
    if (lit == 0)
      continue;
    if (!aimed)
      aim(block, points, kOwnSurface_m);
    aimed = true;
    turn(block, w);
    rays += static_cast<std::uint64_t>(__builtin_popcount(lit));
    if (const std::uint32_t blocked = casters.objects->occluded(lit, block)) {
      lost.entries.push_back({static_cast<std::uint32_t>(j), blocked});
      lost.lanes |= blocked;
    }
  }
}

void sum_on_room(const LightGates& lights, const LostLights& lost, const ShadowCasters& casters,
                 const PointBlock& points, RoomShadow room_shadow, LaneSums& sums, std::uint64_t& rays) {
  RayBlock block;
  aim(block, points, kOwnSurface_m);
  alignas(64) float e[3][kLanes];
  auto next = lost.entries.begin();
  for (std::size_t j = 0; j < lights.size(); ++j) {
    const bool shadowed = next != lost.entries.end() && next->light == j;
    const std::uint32_t behind = shadowed ? (next++)->lanes : 0u;
    const std::uint32_t lit = lights.received(j, points, e);
    if (lit == 0)
      continue;
    const std::uint32_t asked = room_shadow == RoomShadow::everywhere ? lit : behind;
    std::uint32_t by_room = 0;
    if (asked && !casters.occluders->empty()) {
      turn(block, lights.direction(j));
      by_room = casters.occluders->occluded(asked, block);
      rays += static_cast<std::uint64_t>(__builtin_popcount(asked));
    }
    add(sums.unblocked, lights.irradiance(j), e, 0);
    add(sums.past_room, lights.irradiance(j), e, by_room);
    add(sums.past_both, lights.irradiance(j), e, by_room | behind);
  }
}

} // namespace daylit
