#pragma once

// Which lights the objects take from sixteen points, and what is left: the exact-visibility twin of
// render/shaders/light_fragment.glsl.
//
// Neighbouring pixels mostly lose the same lights. Visibility is traced at one pixel in sixteen first, all lights of a
// point together; where the four corners of a block of pixels agree on a light, the block takes their answer, and only
// the lights that they disagree on are traced for every pixel.

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/object/bounds.h"
#include "runtime/sky/window_cone.h"
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
  glm::vec3 low{0.0f}, high{0.0f}; ///< box around the objects
};

/// False when no light of the cone can reach a point of the sphere (centre, radius) through the casters' sphere.
bool may_be_shadowed(const LightCone& cone, const ShadowCasters& casters, const glm::vec3& centre, float radius);

/// Answers for groups of sixteen lights at one point: bit k of word g is light 16 g + k.
struct LightBits {
  std::uint16_t facing = 0;  ///< the point faces the light
  std::uint16_t blocked = 0; ///< of those: an object is in the way
  std::uint16_t by_room = 0; ///< of those that no object blocks: the room does
};

/// Traces the lights that face a point of an object or of the room past the objects, for an object's also past the
/// room. Surfaces of the room nearer than kOwnSurface_m to a point of it are its own.
enum class PointOf { object, room };
void trace_point(const LightGates& lights, const ShadowCasters& casters, const glm::vec3& start,
                 const glm::vec3& normal, PointOf point_of, std::span<LightBits> bits, std::uint64_t& rays);

/// What four corners say about the points between them.
struct Agreement {
  std::uint16_t clear = 0, blocked = 0;           ///< all face the light and say so, of the objects
  std::uint16_t room_clear = 0, room_blocked = 0; ///< of the room
};
/// No corners (empty span): nothing is agreed on.
Agreement agree(std::span<const std::span<const LightBits>> corners, std::size_t group);

/// Lanes that do not lose a light, and lanes that do.
struct Verdict {
  std::uint32_t clear = 0, blocked = 0;
};

/// Lights of a group that the objects take from a block of points.
struct BlockedLights {
  struct Entry {
    std::uint32_t light, lanes;
  };
  std::vector<Entry> entries;    ///< ascending lights
  std::uint32_t lanes = 0;       ///< that lose any
  std::vector<Verdict> verdicts; ///< per light: lanes of which it is known
};

/// What is known of 64 lights at one point.
struct LightWord {
  std::uint64_t clear = 0, blocked = 0;
};
/// Writes the verdicts of the first lanes to the words of their points, one pointer for each.
void note_verdicts(const BlockedLights& blocked, std::span<LightWord* const> words);

/// What the points around those of a block say of each light: where all that know agree, two at least, it is believed.
class LightHints {
public:
  void reset(std::size_t lights);
  void set(int lane, std::span<const LightWord* const> neighbours);
  /// Lights 64 `word` to 64 `word` + 63 of a lane.
  void know(int lane, std::size_t word, const LightWord& known);
  std::span<const Verdict> verdicts() const { return verdicts_; }

private:
  std::vector<Verdict> verdicts_;
};

/// Replaces `blocked`. `starts`: where the rays of the points begin. `only_near`: the points lie on the room, lights
/// whose rays miss the casters' sphere are skipped. `hints`: what needs no rays; may be empty.
void find_blocked_lights(const LightGates& lights, const ShadowCasters& casters, const PointBlock& points,
                         const PointBlock& starts, float tnear, bool only_near,
                         std::span<const std::span<const LightBits>> corners, std::span<const Verdict> hints,
                         BlockedLights& blocked, std::uint64_t& rays);

enum class RoomShadow {
  where_blocked, ///< looked for only along rays that the objects block: enough for what the objects take
  everywhere,    ///< for every light: past_room is exact
  on_objects,    ///< the same; the points lie on the objects, so that most lights need no rays
};

/// Light that the room keeps from a point is lost to nobody. `corners`: asked about the room; none for points of it.
void sum_lights(const LightGates& lights, const BlockedLights& blocked, const ShadowCasters& casters,
                const PointBlock& points, const PointBlock& starts, float tnear, RoomShadow room_shadow,
                std::span<const std::span<const LightBits>> corners, LaneSums& sums, std::uint64_t& rays);

// Surfaces nearer than this to a point of the room are taken to be its own, metres.
constexpr float kOwnSurface_m = 2e-4f;

} // namespace daylit
