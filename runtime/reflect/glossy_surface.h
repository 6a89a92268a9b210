#pragma once

// A point of a glossy object with its material, for the sources of GlossyRays.

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>
#include <glm/mat2x2.hpp>
#include <glm/matrix.hpp>

#include "runtime/reflect/glossy_rays.h"
#include "scene/sky/sun.h"

namespace daylit {

inline float largest(const Rgb& c) { return std::max({c.r, c.g, c.b}); }

constexpr int kAllColours = -1;            ///< of a ray; else the number of the only one
constexpr std::size_t kLightPatterns = 16; ///< of the frame's lights of the sky
constexpr auto kSunRadius = static_cast<float>(kSunAngularRadius);
/// How normals are spread over a pixel: sum over its two sides of t t^T, t the turn along the side, radians along
/// tangent and bitangent of a surface.
using NormalSpread = glm::mat2;
inline NormalSpread even_spread(float turn_rad) { return NormalSpread(turn_rad * turn_rad); }
/// Of a symmetric matrix: roots of the eigenvalues, the larger first, and the direction that belongs to it.
struct Axes {
  glm::vec2 length{0.0f}, first{1.0f, 0.0f};

  explicit Axes(const glm::mat2& m) {
    const float mean = 0.5f * (m[0][0] + m[1][1]), half = 0.5f * (m[0][0] - m[1][1]), apart = std::hypot(half, m[0][1]),
                angle = 0.5f * std::atan2(m[0][1], half);
    length = glm::sqrt(glm::vec2(mean + apart, std::max(mean - apart, 0.0f)));
    first = {std::cos(angle), std::sin(angle)};
  }
  glm::vec2 to_plane(const glm::vec2& p) const { return p.x * first + p.y * glm::vec2(-first.y, first.x); }
  /// With other lengths.
  glm::mat2 matrix(const glm::vec2& sides) const {
    const glm::vec2 a = to_plane({sides.x, 0.0f}), b = to_plane({0.0f, sides.y});
    return glm::outerProduct(a, a) + glm::outerProduct(b, b);
  }
  /// In the frame of these axes.
  glm::vec3 turned(const glm::vec3& w) const {
    return {first.x * w.x + first.y * w.y, first.x * w.y - first.y * w.x, w.z};
  }
};

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
