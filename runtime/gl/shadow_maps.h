#pragma once

#include <span>

#include "runtime/gl/gl_objects.h"
#include "runtime/shading/portal_lights.h"

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

} // namespace daylit
