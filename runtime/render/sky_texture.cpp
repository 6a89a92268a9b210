#include "runtime/render/sky_texture.h"

#include <algorithm>
#include <cmath>

#include <glm/vec4.hpp>

namespace daylit {

Result<void> SkyTexture::upload(const Gl& gl, std::span<const SkyMap> pyramid) {
  if (pyramid.empty())
    return Error{ErrorCode::value_invalid, "no sky map", "renderer", ""};
  const int levels = static_cast<int>(pyramid.size());
  if (pyramid[0].width != width_ || levels != levels_) {
    texture_ = make_texture(gl, GL_TEXTURE_2D);
    gl->TextureStorage2D(texture_.name(), levels, GL_RGBA32F, pyramid[0].width, pyramid[0].height);
    gl->TextureParameteri(texture_.name(), GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
    gl->TextureParameteri(texture_.name(), GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    gl->TextureParameteri(texture_.name(), GL_TEXTURE_WRAP_S, GL_REPEAT);
    gl->TextureParameteri(texture_.name(), GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    width_ = pyramid[0].width;
    levels_ = levels;
  }
  std::vector<glm::vec4> texels;
  for (int level = 0; level < levels; ++level) {
    const SkyMap& map = pyramid[level];
    texels.assign(map.radiance.size(), glm::vec4(0.0f));
    std::transform(map.radiance.begin(), map.radiance.end(), texels.begin(),
                   [](const Rgb& c) { return glm::vec4(c, 1.0f); });
    gl->TextureSubImage2D(texture_.name(), level, 0, 0, map.width, map.height, GL_RGBA, GL_FLOAT, texels.data());
  }
  return check_gl(*gl, "uploading the sky");
}

float sky_texture_level(std::span<const SkyMap> pyramid, const glm::dvec3& w, double solid_angle_sr) {
  if (pyramid.empty())
    return 0.0f;
  const int row = std::min(static_cast<int>(pyramid[0].position(w).y), pyramid[0].height - 1);
  const double texel_sr = pyramid[0].solid_angle_sr(row);
  return static_cast<float>(std::max(0.5 * std::log2(std::max(solid_angle_sr, 1e-12) / texel_sr), 0.0));
}

} // namespace daylit
