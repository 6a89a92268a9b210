#pragma once

#include "runtime/light/window_cone.h"
#include "runtime/render/gl_objects.h"

namespace daylit {

/// A depth-compare texture array with one layer per light, drawn along the light onto the bounding sphere's disc.
class ShadowMaps {
public:
  /// `texels` on a side; layers are allocated by draw() when their number changes.
  static Result<ShadowMaps> make(const Gl& gl, int texels);

  /// Draws `vertices` of the array into the layers of lights [first, first + count) of the bound light buffer.
  /// `indices` 0: without an index buffer. Depth range: +- depth_extent metres around the sphere's centre.
  Result<void> draw(GLuint program, GLuint vertex_array, int vertices, bool indexed, int first, int count,
                    const BoundingSphere& sphere_in_scene, double depth_extent);
  /// One empty layer that shadows nothing: for groups without lights or occluders.
  Result<void> clear();
  GLuint texture() const { return texture_.name(); }
  int texels() const { return texels_; }

private:
  Result<void> allocate(int layers);
  Gl gl_;
  GlTexture texture_;
  GlFramebuffer framebuffer_;
  int texels_ = 0, layers_ = 0;
};

} // namespace daylit
