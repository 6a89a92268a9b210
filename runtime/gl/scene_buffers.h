#pragma once

// Room, objects and lights in graphics memory: as triangles to draw, and as lists that shaders look up.

#include <span>
#include <vector>

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "runtime/gl/gl_objects.h"
#include "runtime/picture/picture_renderer.h"
#include "runtime/shading/portal_lights.h"
#include "scene/room/room.h"

namespace daylit {

/// What casts shadows.
struct ShadowCaster {
  GLuint vertex_array = 0; ///< positions at location 0, relative to the scene's origin
  int vertices = 0;        ///< to draw
  bool indexed = false;
};

/// A depth-compare texture array with one layer per light, drawn along the light onto the disc of the objects' sphere
/// (shaders/shadow_vertex.glsl).
class ShadowMaps {
public:
  /// `texels` on a side; layers are allocated by draw() when there are too few.
  static Result<ShadowMaps> make(const Gl& gl, int texels);

  /// `half_depth`: of the maps around the sphere's centre, metres. Frame uniforms must be bound.
  Result<void> draw(const GlProgram& program, const ShadowCaster& caster, std::span<const PortalLight> lights,
                    float half_depth);
  GLuint texture() const { return texture_.name(); }

private:
  Result<void> allocate(int layers);
  Gl gl_;
  GlTexture texture_;
  GlFramebuffer framebuffer_;
  int texels_ = 0, layers_ = 0;
};

/// The reflecting triangles of a room, relative to `origin`. Ids start at 1.
class RoomBuffers {
public:
  /// Error limit_exceeded: more triangles than ids.
  static Result<RoomBuffers> make(const Gl& gl, const Room& room, std::span<const Aperture> apertures,
                                  const glm::dvec3& origin);
  void draw(const Gl& gl) const;
  /// The openings that a ray from `eye` leaves by: what is seen of the room ends there.
  void draw_openings(const Gl& gl, const glm::vec3& eye) const;
  void bind(const Gl& gl) const; ///< lists of shaders/picture_fragment.glsl
  /// Of the room; kUnknownTriangle for id 0.
  std::uint32_t triangle(std::uint32_t id) const;
  /// Where a ray from `eye` meets its plane, relative to the origin; ids from 1.
  glm::vec3 position(std::uint32_t id, const glm::vec3& eye, const glm::vec3& ray) const;
  /// What can stand between the objects and the sky.
  ShadowCaster occluder() const { return {occluder_array_.name(), occluder_vertex_count_, false}; }
  std::size_t occluders() const { return static_cast<std::size_t>(occluder_vertex_count_) / 3; }

private:
  GlBuffer vertices_, occluder_vertices_, plane_list_;
  GlVertexArray array_, occluder_array_;
  std::vector<std::uint32_t> source_; ///< in the room, of each triangle
  std::vector<glm::vec4> planes_;     ///< the same: dot(xyz, x) + w = 0, unit
  struct Opening {
    glm::vec4 plane; ///< positive inside
    int first, vertices;
  };
  std::vector<Opening> openings_; ///< after the triangles
  int occluder_vertex_count_ = 0;
};

class ObjectBuffers {
public:
  /// Error limit_exceeded: more triangles than ids.
  Result<void> set(const Gl& gl, const ObjectSurface& objects, const glm::dvec3& origin);
  Result<void> set_light(const Gl& gl, std::span<const VertexLight> light);
  void draw(const Gl& gl) const;
  void bind(const Gl& gl) const; ///< lists of shaders/object_surface.glsl

  const BoundingSphere& sphere() const { return sphere_; } ///< relative to the origin; radius above 0
  std::size_t vertices() const { return vertex_count_; }
  ShadowCaster caster() const { return {array_.name(), index_count_, true}; }

private:
  GlBuffer vertices_, indices_, light_;
  GlVertexArray array_;
  std::size_t vertex_count_ = 0;
  int index_count_ = 0;
  BoundingSphere sphere_{glm::dvec3(0.0), 1e-6};
};

/// The lists of shaders/portal_lights.glsl.
class LightBuffers {
public:
  Result<void> set(const Gl& gl, const PortalLights& lights);
  void bind(const Gl& gl) const;

private:
  GlBuffer lights_, portals_, planes_;
};

} // namespace daylit
