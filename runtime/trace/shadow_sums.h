#pragma once

// Sums over the lights of a group of what reaches sixteen points: the exact-visibility twin of sum_lights() in
// render/shaders/lighting.glsl.

#include <cstdint>
#include <vector>

#include "runtime/light/window_cone.h"
#include "runtime/trace/light_gates.h"
#include "runtime/trace/packet_scene.h"

namespace daylit {

/// Sum over lights of irradiance, of irradiance past the room, and of irradiance past room and objects.
struct alignas(64) LaneSums {
  float unblocked[3][kLanes] = {}, past_room[3][kLanes] = {}, past_both[3][kLanes] = {};
};

struct ShadowCasters {
  const PacketScene* objects = nullptr;
  const PacketScene* occluders = nullptr; ///< the parts of the room that can stand between a point and the sky
  glm::vec3 centre{0.0f};                 ///< sphere around the objects, relative to the scenes' origin
  float radius = 0.0f;
};

/// Cone that holds all light directions of a group: which blocks the objects can shadow at all.
struct LightCone {
  glm::vec3 axis{0.0f, 0.0f, 1.0f};
  float half_angle = -10.0f; ///< radians; negative: no lights
};

/// False when no light of the cone can reach a point of the sphere (centre, radius) through the casters' sphere.
bool may_be_shadowed(const LightCone& cone, const ShadowCasters& casters, const glm::vec3& centre, float radius);

/// Points on the objects themselves; `origins` are where their rays start.
void sum_on_objects(const LightGates& lights, const ShadowCasters& casters, const PointBlock& points,
                    const PointBlock& origins, LaneSums& sums, std::uint64_t& rays);

/// Lights of a group that the objects take from a block of points of the room.
struct LostLights {
  struct Entry {
    std::uint32_t light, lanes;
  };
  std::vector<Entry> entries; ///< ascending lights
  std::uint32_t lanes = 0;    ///< that lose any
};

/// Replaces `lost`.
void find_lost_lights(const LightGates& lights, const ShadowCasters& casters, const PointBlock& points,
                      LostLights& lost, std::uint64_t& rays);

enum class RoomShadow {
  where_lost, ///< looked for only along rays that the objects block: enough for what the objects take
  everywhere, ///< for every light: past_room is exact
};

/// Sums at points of the room; light that the room keeps from a point is lost to nobody.
void sum_on_room(const LightGates& lights, const LostLights& lost, const ShadowCasters& casters,
                 const PointBlock& points, RoomShadow room_shadow, LaneSums& sums, std::uint64_t& rays);

} // namespace daylit
