#pragma once

// The passes of a picture: shadow maps, ids of triangles, light.

#include <vector>

#include <glm/vec4.hpp>

#include "runtime/base/render_camera.h"
#include "runtime/gl/gl_objects.h"
#include "runtime/gl/scene_buffers.h"
#include "runtime/object/bounds.h"

namespace daylit {

/// What the passes draw into: the G-buffer (ids of triangles), and the lit picture.
class RenderTargets {
public:
  /// Error limit_exceeded: larger than the driver's textures.
  static Result<RenderTargets> make(const Gl& gl, int width_px, int height_px, int samples);
  int width_px() const { return width_; }
  int height_px() const { return height_; }

  void start_room_ids() const;   ///< cleared, depth test on
  void start_object_ids() const; ///< cleared, depth test on
  void start_picture() const;    ///< nothing is cleared: every pixel is written
  GLuint room_ids() const { return room_ids_.name(); }
  GLuint object_ids() const { return object_ids_.name(); }
  GLuint object_depths() const { return object_depths_.name(); }

  static constexpr int kPasses = 3; ///< of the picture: see shaders/picture_fragment.glsl
  /// All passes of the picture, one after the other, row 0 first. Waits until they are drawn.
  Result<void> read_picture(std::vector<glm::vec4>& texels) const;

private:
  Gl gl_;
  GlTexture room_ids_, room_depths_, object_ids_, object_depths_, picture_;
  GlFramebuffer room_, objects_, lit_;
  int width_ = 0, height_ = 0;

  void start_ids(const GlFramebuffer& target) const;
};

/// The lights of a frame, those of the sky first.
struct FrameLights {
  PortalLights lights;
  std::size_t sky_count = 0;
  LightCone sky_cone, sun_cone;
  Rgb sun_normal_irradiance{0.0f};
};

class FramePasses {
public:
  /// `samples`: of the objects' ids per pixel. `room_occludes`: some of the room can stand between objects and sky.
  static Result<FramePasses> make(const Gl& gl, int map_texels, int samples, bool room_occludes);

  /// Uniforms for all that follow. `sphere`: around the objects, relative to the origin; `room_half_depth`: of the
  /// room's shadow maps, metres.
  void set_frame(const PinholeCamera& camera, const glm::dvec3& origin, const BoundingSphere& sphere,
                 float room_half_depth, const FrameLights& lights);
  Result<void> draw_shadow_maps(const RoomBuffers& room, const ObjectBuffers& objects, const FrameLights& lights);
  void draw_room_ids(const RoomBuffers& room, const glm::vec3& eye, const RenderTargets& targets) const;
  void draw_object_ids(const RoomBuffers& room, const ObjectBuffers& objects, const RenderTargets& targets) const;
  void light_picture(const RoomBuffers& room, const ObjectBuffers& objects, const LightBuffers& lights,
                     const RenderTargets& targets) const;

private:
  Gl gl_;
  GlProgram shadow_, ids_, picture_;
  GlVertexArray nothing_; ///< for the pass over the whole picture
  GlBuffer frame_;
  ShadowMaps object_maps_, room_maps_;
  int map_texels_ = 0;
  bool room_occludes_ = false;
  float object_half_depth_ = 1.0f, room_half_depth_ = 1.0f;
};

} // namespace daylit
