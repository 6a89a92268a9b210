#pragma once

// Directional lights with the portal clip planes of every aperture that they come through.
//
// For a fixed direction w the ray x + t w passes an edge of a planar aperture on the inside exactly when x lies on the
// inner side of the plane through that edge along w (Grosch et al. 2007, section 7.1). Each pair of light and aperture
// is therefore a fixed set of planes in x, whose transmittance, the slab of clear glass included, is a constant: the
// test of a point costs one dot product per edge. Both renderers use the same planes.

#include <span>
#include <vector>

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "runtime/shading/point_block.h"
#include "runtime/sky/direct_light.h"

namespace daylit {

/// Laid out as shaders read it (std430).
struct PortalLight {
  glm::vec3 direction{0.0f}; ///< unit, towards the light
  std::uint32_t first_portal = 0;
  Rgb irradiance{0.0f}; ///< on a plane facing it, before panes
  std::uint32_t last_portal = 0;
};

struct alignas(16) Portal {
  Rgb transmittance{1.0f};
  std::uint32_t first_plane = 0, last_plane = 0; ///< dot(plane.xyz, x) + plane.w >= 0 inside, metres
};

class PortalLights {
public:
  PortalLights() = default;
  /// Points are given relative to `origin` (world metres).
  PortalLights(std::span<const DirectionalLight> lights, std::span<const Aperture> apertures, const glm::dvec3& origin);

  std::size_t size() const { return lights_.size(); }
  bool empty() const { return lights_.empty(); }
  const glm::vec3& direction(std::size_t light) const { return lights_[light].direction; }
  const Rgb& irradiance(std::size_t light) const { return lights_[light].irradiance; }
  std::span<const PortalLight> lights() const { return lights_; }
  std::span<const Portal> portals() const { return portals_; }
  std::span<const glm::vec4> planes() const { return planes_; }
  /// Sixteen by sixteen.
  std::span<const DirectionBlock> direction_blocks() const { return blocks_; }

  /// Sets e = max(0, n.w) x product of the transmittances of the apertures crossed, 0 where none is: the fraction of
  /// the light's irradiance that each point receives with nothing in the way. Returns the lanes with any light.
  LaneMask received(std::size_t light, const PointBlock& points, LaneRgb& e) const;

private:
  std::vector<PortalLight> lights_;
  std::vector<Portal> portals_;
  std::vector<glm::vec4> planes_;
  std::vector<DirectionBlock> blocks_;
};

} // namespace daylit
