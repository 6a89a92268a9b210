#pragma once

#include <vector>

#include "runtime/gl/depth_raster.h"
#include "runtime/gl/gl_objects.h"

namespace daylit {

/// What casts shadows, for OpenGL and for the processor.
struct ShadowCaster {
  GLuint vertex_array = 0; ///< positions at location 0, relative to the scene's origin
  int vertices = 0;        ///< to draw
  bool indexed = false;
  DepthRaster mesh; ///< the same, relative to the sphere's centre
};

/// A depth-compare texture array with one layer per light, drawn along the light onto the bounding sphere's disc.
class ShadowMaps {
public:
  /// `texels` on a side; layers are allocated by draw() when there are too few. `by_processor`: see depth_raster.h.
  static Result<ShadowMaps> make(const Gl& gl, int texels, bool by_processor);

  /// `centre` and the radius, caster.mesh.half_width: of the sphere, in the scene.
  Result<void> draw(GLuint program, const ShadowCaster& caster, std::span<const MapAxes> lights,
                    const glm::vec3& centre);
  GLuint texture() const { return texture_.name(); }

private:
  /// One empty layer that shadows nothing: for groups without lights or occluders.
  Result<void> clear();
  Result<void> allocate(int layers);
  Gl gl_;
  GlTexture texture_;
  GlFramebuffer framebuffer_;
  std::vector<std::uint16_t> depths_;
  int texels_ = 0, layers_ = 0;
  bool by_processor_ = false;
};

} // namespace daylit
