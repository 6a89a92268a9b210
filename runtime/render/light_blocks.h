#pragma once

// What the shaders know about the light of a frame: uniform blocks of the lights and of the apertures, and the uniforms
// that go with them (shaders/lighting.glsl).

#include <span>

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "runtime/light/direct_light.h"
#include "runtime/render/gl_objects.h"
#include "scene/room.h"

namespace daylit {

class LightBlocks {
public:
  /// Positions in the blocks are relative to `origin` (world metres). Error limit_exceeded: too many windows.
  static Result<LightBlocks> make(const Gl& gl, std::span<const Aperture> apertures, const glm::dvec3& origin);

  /// Error limit_exceeded: more than kMaxLights.
  Result<void> set_lights(const LightSet& lights);
  void bind() const;
  void set_uniforms(GLuint program) const;

  int sky_lights() const { return sky_lights_; }
  int sun_lights() const { return sun_lights_; } ///< they follow the sky's

private:
  Gl gl_;
  GlBuffer lights_, apertures_, aperture_edges_;
  int sky_lights_ = 0, sun_lights_ = 0, aperture_count_ = 0;
  glm::vec4 sky_cone_{0.0f}, sun_cone_{0.0f};
  Rgb sun_normal_irradiance_{0.0f};

  Result<void> upload_apertures(std::span<const Aperture> list, const glm::dvec3& origin);
};

} // namespace daylit
