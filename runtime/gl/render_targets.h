#pragma once

// What the passes of a picture draw into: the G-buffer (ids of triangles), and the lit picture.

#include <vector>

#include <glm/vec4.hpp>

#include "runtime/gl/gl_objects.h"

namespace daylit {

class RenderTargets {
public:
  /// Error limit_exceeded: larger than the driver's textures.
  static Result<RenderTargets> make(const Gl& gl, int width_px, int height_px, int samples);
  int width_px() const { return width_; }
  int height_px() const { return height_; }

  void start_room_ids() const;    ///< cleared, depth test on
  void start_object_ids() const;  ///< cleared, depth test on
  void start_picture() const;     ///< nothing is cleared: every pixel is written
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

} // namespace daylit
