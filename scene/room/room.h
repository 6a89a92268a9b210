#pragma once

// A room: triangles with diffuse materials, and apertures. World frame: right-handed, z up, metres.

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include "scene/image/rgb_image.h"

namespace daylit {

struct Material {
  std::string name;
  Rgb reflectance{0.5f};   ///< Lambertian, linear, each channel in 0..1
  Rgb transmittance{1.0f}; ///< of a window pane, any angle; 1 = open. Unused unless is_window
  bool is_window = false;  ///< is_window_name()
  /// 0: transmittance is all there is. 1 and above: clear glass, the Fresnel slab of this index (scene/room/glass.h)
  /// times transmittance.
  float refractive_index = 0.0f;
};

/// True for the names that make a material an aperture, in any case.
bool is_window_name(const std::string& material_name);

struct RoomTriangle {
  std::array<std::uint32_t, 3> vertex{};
  std::uint32_t material = 0;
};

struct Bounds {
  glm::dvec3 min{std::numeric_limits<double>::infinity()};
  glm::dvec3 max{-std::numeric_limits<double>::infinity()};
  void include(const glm::dvec3& p) {
    min = glm::dvec3(p.x < min.x ? p.x : min.x, p.y < min.y ? p.y : min.y, p.z < min.z ? p.z : min.z);
    max = glm::dvec3(p.x > max.x ? p.x : max.x, p.y > max.y ? p.y : max.y, p.z > max.z ? p.z : max.z);
  }
  bool empty() const { return !(min.x <= max.x); }
  glm::dvec3 size() const { return max - min; }
  glm::dvec3 centre() const { return 0.5 * (min + max); }
};

/// Faces are two-sided diffuse reflectors; window faces reflect nothing and are in no ray scene.
struct Room {
  std::vector<glm::dvec3> vertices; ///< metres, world frame
  std::vector<RoomTriangle> triangles;
  std::vector<Material> materials;

  glm::dvec3 corner(const RoomTriangle& t, int k) const { return vertices[t.vertex[k]]; }
  const Material& material(const RoomTriangle& t) const { return materials[t.material]; }
  bool is_window(const RoomTriangle& t) const { return materials[t.material].is_window; }
  Bounds bounds() const;
};

/// Unnormalised normal, length = twice the area (m^2).
glm::dvec3 area_normal(const Room& room, const RoomTriangle& triangle);
double area_m2(const Room& room, const RoomTriangle& triangle);

/// A convex planar opening through which daylight enters: a window pane, or a plain hole in a wall found by rays
/// (scene/room/aperture.h). Corners in order around the outline.
struct Aperture {
  std::vector<glm::dvec3> corners; ///< metres, at least three, coplanar, convex
  glm::dvec3 inward{0.0};          ///< unit normal pointing into the room
  Rgb transmittance{1.0f};         ///< any angle; pane_transmittance (scene/room/glass.h) is the whole
  float refractive_index = 0.0f;   ///< as in Material
};

} // namespace daylit
