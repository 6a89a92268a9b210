#pragma once

// What the passes of a picture draw into.

#include <span>
#include <vector>

#include <glm/vec4.hpp>

#include "runtime/base/pixel_box.h"
#include "runtime/gl/gl_objects.h"

namespace daylit {

/// Colour textures drawn together, with or without a depth texture (not owned).
class DrawTarget {
public:
  /// `samples` 0: not multisampled.
  static Result<DrawTarget> make(const Gl& gl, int width, int height, GLenum format, int colours, GLuint depth,
                                 int samples = 0);
  void bind() const;
  void clear_colours() const; ///< to zero, within the scissor rectangle
  void clear_depth() const;   ///< to zero: infinitely far
  GLuint texture(int k) const { return colours_[static_cast<std::size_t>(k)].name(); }
  /// Row 0 first; `texels` is resized to the box's size.
  Result<void> read(int k, const PixelBox& box, std::vector<glm::vec4>& texels) const;
  /// The whole target, one channel.
  Result<void> read(int k, std::vector<float>& texels) const;

private:
  Gl gl_;
  GlFramebuffer framebuffer_;
  std::vector<GlTexture> colours_;
  int width_ = 0, height_ = 0;
};

/// Sums over lights: unblocked, lost and, where something of the room can block, past the room.
struct LightSums {
  DrawTarget target;
  bool room_blocks = false;
  GLuint unblocked() const { return target.texture(0); }
  GLuint lost() const { return target.texture(1); }
  GLuint past_room() const { return target.texture(room_blocks ? 2 : 0); }
};

struct RenderTargets {
  int width_px = 0, height_px = 0;
  GlTexture room_depth, object_depth, object_marks;
  DrawTarget room_ids;
  DrawTarget object_ids;                  ///< by OpenGL, with object_depth
  GlTexture object_samples, object_shown; ///< by the processor: TriangleRaster
  bool ids_by_processor = false;
  DrawTarget object_points; ///< offset and normal
  DrawTarget object_picture;
  LightSums object_sky, object_sun;
  GlTexture asked_offsets, asked_normals; ///< LightPoints, row by row
  LightSums asked;
  int asked_width = 0, asked_height = 0; ///< multiples of four

  GLuint ids() const { return ids_by_processor ? object_samples.name() : object_ids.texture(0); }
  static Result<RenderTargets> make(const Gl& gl, int width_px, int height_px, int samples, bool room_blocks,
                                    bool ids_by_processor);
};

} // namespace daylit
