#pragma once

// Which lights the objects take from sixteen points, and what is left, by rays: the exact twin of
// gl/shaders/light_sums.glsl.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "runtime/object/bounds.h"
#include "runtime/shading/lane_kernels.h"
#include "runtime/shading/visibility.h"
#include "runtime/trace/glass_faces.h"
#include "runtime/trace/packet_scene.h"

namespace daylit {

/// Which parts of the room can stand before the objects at all: most lights need no rays to find that none does.
class ShadowBounds {
public:
  ShadowBounds() = default;
  ShadowBounds(std::span<const glm::vec3> vertices, std::span<const std::array<std::uint32_t, 3>> triangles);

  /// False when no ray that starts in the sphere and runs along the unit direction w meets a triangle. Conservative.
  bool may_block(const glm::vec3& w, const glm::vec3& centre, float radius) const;

private:
  struct Triangle {
    std::array<glm::vec3, 3> corners;
    glm::vec3 centre{0.0f}; ///< of a sphere around it
    float radius = 0.0f;
  };
  std::vector<Triangle> triangles_;
};

// Surfaces nearer than this to a point of the room are taken to be its own, metres.
constexpr float kOwnSurface_m = 2e-5f;

struct ShadowCasters {
  const PacketScene* opaque = nullptr;    ///< objects, without their glass
  const GlassFaces* glass = nullptr;      ///< of the objects; null: they have none
  const PacketScene* occluders = nullptr; ///< the parts of the room that can stand between a point and the sky
  glm::vec3 centre{0.0f};                 ///< sphere around the objects, relative to the scenes' origin
  float radius = 0.0f;
  glm::vec3 low{0.0f}, high{0.0f}; ///< box around the objects
};

/// The lights of the sky, or of the sun.
struct TracedLights {
  PortalLights portal;
  LightCone cone;
  float spacing = 0.0f; ///< of the sky's: mean angle of a light to the nearest other, radians
  /// Per light: the room can stand between the objects and it.
  std::vector<std::uint8_t> room_may_block;
  bool room_may_block_any = false;

  std::size_t size() const { return portal.size(); }
  /// Of objects within the sphere.
  void find_room_shadows(const ShadowBounds& room, const glm::vec3& centre, float radius);
};

/// False when no light of the cone can reach a point of the sphere (centre, radius) through the casters' sphere.
bool may_be_shadowed(const LightCone& cone, const ShadowCasters& casters, const glm::vec3& centre, float radius);

/// Visibility::see_sun(): traces the lights that the point faces past the objects, for a point of an object also past
/// the room. Returns the number of rays.
std::uint64_t see_point(const TracedLights& lights, const ShadowCasters& casters, Layer layer, const PixelSurface& at,
                        std::span<KnownLights> objects, std::span<KnownLights> room);

/// Where the rays of the points begin: one block for all lights, or one for each.
class RayStarts {
public:
  explicit RayStarts(const PointBlock& all) : blocks_(&all, 1) {}
  explicit RayStarts(std::span<const PointBlock> each) : blocks_(each) {}
  const PointBlock& of(std::size_t light) const { return blocks_[blocks_.size() == 1 ? 0 : light]; }
  bool differ() const { return blocks_.size() > 1; }

private:
  std::span<const PointBlock> blocks_;
};

/// Replaces `blocked`: the lights that objects take from the points, or weaken. `hints`: what needs no rays, may be
/// empty. Returns the number of rays.
std::uint64_t find_blocked_lights(const TracedLights& lights, const ShadowCasters& casters, Layer layer,
                                  const PointBlock& points, const RayStarts& starts, std::span<const LaneVerdict> hints,
                                  BlockedLights& blocked);

/// Adds all lights. Light that the room keeps from a point is lost to nobody. `room_hints`: of the room, may be empty.
/// Returns the number of rays.
std::uint64_t sum_lights(const TracedLights& lights, const BlockedLights& blocked, const ShadowCasters& casters,
                         Layer layer, const PointBlock& points, const RayStarts& starts,
                         std::span<const LaneVerdict> room_hints, lanes::LightSums& sums);

} // namespace daylit
