#pragma once

// Which light passes which window, for blocks of sixteen points.
//
// For a fixed direction w the ray x + t w passes an edge of a planar aperture on the inside exactly when x lies on the
// inner side of the plane through that edge along w. Each pair (light, aperture) is therefore a fixed set of planes in
// x, a "gate", whose transmittance, the slab of clear glass included, is a constant: the aperture test of a point costs
// one dot product per edge.

#include <span>
#include <vector>

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "runtime/sky/direct_light.h"
#include "runtime/trace/occluder_reach.h"
#include "runtime/trace/packet_scene.h"

namespace daylit {

/// Up to sixteen points with normals, relative to the scene's origin; lanes beyond the used ones hold copies.
struct alignas(64) PointBlock {
  float x[kLanes], y[kLanes], z[kLanes];
  float nx[kLanes], ny[kLanes], nz[kLanes]; ///< unit, towards the side that is lit
  std::uint32_t lanes = 0;                  ///< bits of the used lanes
  glm::vec3 centre{0.0f};                   ///< of a sphere around the points
  float radius = 0.0f;
  void set(int lane, const glm::vec3& position, const glm::vec3& normal);
  /// The first `count` lanes are used. The others repeat the first point, so that vector code needs no masks.
  void close(int count);
};

/// Directions of sixteen lights; the last block repeats its last light.
struct alignas(64) DirectionBlock {
  float x[kLanes], y[kLanes], z[kLanes];
};

struct Gate {
  std::uint32_t first = 0, last = 0; ///< planes, unit normals, inside positive
  Rgb transmittance{1.0f};
};

class LightGates {
public:
  LightGates() = default;
  LightGates(std::span<const DirectionalLight> lights, std::span<const Aperture> apertures, const glm::dvec3& origin);

  std::size_t size() const { return lights_.size(); }
  const glm::vec3& direction(std::size_t light) const { return lights_[light].direction; }
  const Rgb& irradiance(std::size_t light) const { return lights_[light].irradiance; }
  const std::vector<DirectionBlock>& direction_blocks() const { return blocks_; }

  /// Which lights the room can keep from the objects; all until this is called.
  void find_room_shadows(const OccluderReach& room, const glm::vec3& centre, float radius);
  /// The room can stand between the objects and the light.
  bool room_may_block(std::size_t light) const { return lights_[light].room_may_block; }
  bool room_may_block_any() const { return room_may_block_any_; }

  /// Share e of the light's irradiance that each lane receives with nothing in the way: cosine x panes, per channel.
  /// Returns the lanes with any light.
  std::uint32_t received(std::size_t light, const PointBlock& points, float (&e)[3][kLanes]) const;

private:
  struct Light {
    glm::vec3 direction{0.0f};
    Rgb irradiance{0.0f};
    std::uint32_t first_gate = 0, last_gate = 0;
    bool room_may_block = true;
  };
  std::vector<Light> lights_;
  std::vector<DirectionBlock> blocks_;
  std::vector<Gate> gates_;
  std::vector<glm::vec4> planes_;
  bool room_may_block_any_ = true;
};

} // namespace daylit
