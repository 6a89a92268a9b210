#pragma once

#include <span>

#include "runtime/light/sky_map.h"
#include "runtime/render/gl_objects.h"

namespace daylit {

/// The sky without its sun as a mip-mapped float texture, one mip level per pyramid level.
class SkyTexture {
public:
  Result<void> upload(const Gl& gl, std::span<const SkyMap> pyramid);
  GLuint texture() const { return texture_.name(); }

private:
  GlTexture texture_;
  int width_ = 0, levels_ = 0;
};

/// Mip level whose texels are about as large as `solid_angle_sr` in the direction w.
float sky_texture_level(std::span<const SkyMap> pyramid, const glm::dvec3& w, double solid_angle_sr);

} // namespace daylit
