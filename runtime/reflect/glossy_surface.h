#pragma once

// A point of a glossy object with its material, for the sources of GlossyRays.

#include <algorithm>

#include <glm/geometric.hpp>

#include "runtime/reflect/glossy_rays.h"
#include "scene/sky/sun.h"

namespace daylit {

inline float largest(const Rgb& c) { return std::max({c.r, c.g, c.b}); }

constexpr int kAllColours = -1;            ///< of a ray; else the number of the only one
constexpr std::size_t kLightPatterns = 16; ///< of the frame's lights of the sky
constexpr auto kSunRadius = static_cast<float>(kSunAngularRadius);
/// The pixel, in which the normal turns so far, is narrower than the sun in the mirror.
inline bool meets_disc(float turn_rad) { return turn_rad < kSunRadius; }

struct GlossyRays::Surface {
  SurfaceMaterial material;
  glm::vec3 tangent{0.0f}, bitangent{0.0f}, normal{0.0f}; ///< world
  glm::vec3 smooth{0.0f};                                 ///< normal without the map, on the same side
  glm::vec3 out{0.0f};                                    ///< local, towards where the ray came from
  Bsdf bsdf;

  float alpha() const { return std::min(material.alpha_u, material.alpha_v); }
  bool is_sharp() const { return alpha() < kWideAlpha; }
  bool has_sharp_coat() const { return material.clearcoat > 0.0f && material.clearcoat_alpha < kWideAlpha; }
  glm::vec3 to_world(const glm::vec3& v) const { return v.x * tangent + v.y * bitangent + v.z * normal; }
  glm::vec3 to_local(const glm::vec3& v) const {
    return {glm::dot(v, tangent), glm::dot(v, bitangent), glm::dot(v, normal)};
  }
};

} // namespace daylit
