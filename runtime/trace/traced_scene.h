#pragma once

// Everything that light meets, as the ray renderer keeps it.

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include <glm/geometric.hpp>

#include "runtime/picture/picture_renderer.h"
#include "runtime/trace/light_visibility.h"
#include "runtime/trace/traced_renderer.h"

namespace daylit {

/// Coordinates are metres relative to `origin`.
struct TracedScene {
  TraceSettings settings;
  glm::dvec3 origin{0.0};
  PacketScene objects, occluders;
  /// Where some of the objects is of glass: that, and the rest.
  std::optional<GlassFaces> glass;
  std::optional<PacketScene> opaque;
  ShadowBounds room_shadow_bounds;
  std::vector<glm::vec3> room_normals;      ///< unit, per triangle of the room's ray scene
  std::vector<std::uint32_t> room_triangle; ///< the same in Room::triangles
  std::vector<glm::vec3> positions, normals;
  std::vector<Rgb> reflectance;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<VertexLight> light;  ///< per vertex
  BoundingSphere sphere;           ///< around the objects, world
  glm::vec3 low{0.0f}, high{0.0f}; ///< box around their vertices
  TracedLights sky, sun;
  Rgb sun_normal_irradiance{0.0f};

  /// Weights of a triangle's corners, whose light a point of it shows. Of a triangle smaller than a sixteenth of a
  /// pixel the nearest corner has all: a dense mesh shows one vertex a pixel, not three. `pitch`: of the pixels at unit
  /// depth.
  std::array<float, 3> light_weights(std::uint32_t triangle, float u, float v, float depth, float pitch) const {
    const auto& t = triangles[triangle];
    const glm::vec3 a = positions[t[0]], twice_area = glm::cross(positions[t[1]] - a, positions[t[2]] - a);
    const float pixel = pitch * depth, most = 0.125f * pixel * pixel, w = 1.0f - u - v;
    if (glm::dot(twice_area, twice_area) > most * most)
      return {w, u, v};
    return {w >= u && w >= v ? 1.0f : 0.0f, u > w && u >= v ? 1.0f : 0.0f, v > w && v > u ? 1.0f : 0.0f};
  }
  /// Nothing of the triangle is drawn: it is black, or what it mirrors is followed elsewhere.
  bool is_black(std::uint32_t triangle) const {
    const auto& t = triangles[triangle];
    return reflectance[t[0]] == Rgb(0.0f) && reflectance[t[1]] == Rgb(0.0f) && reflectance[t[2]] == Rgb(0.0f);
  }
  ShadowCasters casters() const {
    return {opaque ? &*opaque : &objects,
            glass ? &*glass : nullptr,
            &occluders,
            glm::vec3(sphere.centre - origin),
            static_cast<float>(sphere.radius),
            low,
            high};
  }
};

} // namespace daylit
