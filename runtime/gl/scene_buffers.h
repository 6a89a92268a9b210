#pragma once

// Room and objects in graphics memory: as triangles to draw, and as lists to look up by number of the triangle.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "runtime/gl/gl_objects.h"
#include "runtime/gl/shadow_maps.h"
#include "runtime/picture/picture_renderer.h"
#include "scene/room/room.h"

namespace daylit {

/// The reflecting triangles of a room, relative to `origin`.
class RoomBuffers {
public:
  static Result<RoomBuffers> make(const Gl& gl, const Room& room, std::span<const Aperture> apertures,
                                  const glm::dvec3& origin);
  void draw(const Gl& gl) const;
  /// Of the room, of triangle `id` as drawn (from 1).
  std::uint32_t triangle(int id) const { return source_[static_cast<std::size_t>(id - 1)]; }
  /// Its plane: dot(xyz, x) + w = 0, unit.
  const glm::vec4& plane(int id) const { return plane_of_[static_cast<std::size_t>(id - 1)]; }
  /// The same for all triangles of one plane, from 1.
  int plane_number(int id) const { return plane_number_[static_cast<std::size_t>(id - 1)]; }
  std::span<const glm::vec3> corners() const { return corners_; } ///< of all triangles, relative to the origin
  /// Triangles (of corners()) that may hide some of `points` from `eye`: not all lie before its plane.
  std::vector<std::array<std::uint32_t, 3>> that_may_hide(std::span<const glm::vec3> points, const glm::vec3& eye,
                                                          float tolerance) const;
  int count() const { return static_cast<int>(source_.size()); }
  int occluders() const { return static_cast<int>(occluder_triangles_.size()); }
  /// What can stand between the objects and the sky.
  ShadowCaster occluder(const BoundingSphere& sphere, double half_depth);

private:
  GlBuffer vertices_, occluder_vertices_;
  GlVertexArray array_, occluder_array_;
  std::vector<std::uint32_t> source_;
  std::vector<glm::vec4> plane_of_;
  std::vector<int> plane_number_;
  std::vector<glm::vec3> corners_;
  std::vector<glm::vec3> occluder_corners_, around_sphere_;
  std::vector<std::array<std::uint32_t, 3>> occluder_triangles_;
};

class ObjectBuffers {
public:
  /// Error limit_exceeded: more triangles or vertices than numbers or the driver hold.
  Result<void> set(const Gl& gl, const ObjectSurface& objects, const glm::dvec3& origin);
  Result<void> set_light(const Gl& gl, std::span<const VertexLight> light);
  void draw(const Gl& gl) const;
  /// Lists of shaders/object_surface.glsl.
  void bind(const Gl& gl) const;
  GLuint light_list() const { return light_list_.name(); }

  bool empty() const { return triangles_.empty(); }
  const BoundingSphere& sphere() const { return sphere_; }            ///< relative to the origin; radius above 0
  std::span<const glm::vec3> positions() const { return positions_; } ///< relative to the sphere's centre
  std::span<const std::array<std::uint32_t, 3>> triangles() const { return triangles_; }
  ShadowCaster caster() const;

private:
  GlBuffer vertices_, indices_, light_;
  GlVertexArray array_;
  GlTexture triangle_list_, vertex_list_, light_list_;
  std::vector<glm::vec3> positions_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;
  BoundingSphere sphere_{glm::dvec3(0.0), 1e-6};
};

} // namespace daylit
