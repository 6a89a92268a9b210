#include "runtime/render/light_blocks.h"

#include <glm/geometric.hpp>

#include "runtime/light/orthonormal.h"
#include "runtime/render/bounds.h"

namespace daylit {

namespace {

// std140 layouts of shaders/lighting.glsl.
struct GpuLight {
  glm::vec4 right, up, toward, irradiance;
};
struct GpuAperture {
  glm::vec4 plane, transmittance;
  glm::ivec4 edge_range;
};

/// A block must be backed over its whole declared size.
template <class T>
std::span<const std::byte> padded(std::vector<T>& v, int capacity) {
  v.resize(static_cast<std::size_t>(capacity));
  return std::as_bytes(std::span<const T>(v));
}

} // namespace

Result<LightBlocks> LightBlocks::make(const Gl& gl, std::span<const Aperture> apertures, const glm::dvec3& origin) {
  LightBlocks blocks;
  blocks.gl_ = gl;
  if (const auto uploaded = blocks.upload_apertures(apertures, origin); !uploaded)
    return uploaded.error();
  std::vector<GpuLight> none;
  blocks.lights_ = make_buffer(gl, padded(none, kMaxLights));
  return blocks;
}

Result<void> LightBlocks::upload_apertures(std::span<const Aperture> list, const glm::dvec3& origin) {
  std::vector<GpuAperture> planes;
  std::vector<glm::vec4> edges;
  const auto plane_through = [&](const glm::dvec3& n, const glm::dvec3& p) {
    return glm::vec4(glm::vec3(n), static_cast<float>(-glm::dot(n, p - origin)));
  };
  for (const Aperture& a : list) {
    const int first = static_cast<int>(edges.size());
    glm::dvec3 middle(0.0);
    for (const glm::dvec3& c : a.corners)
      middle += c / static_cast<double>(a.corners.size());
    for (std::size_t k = 0; k < a.corners.size(); ++k) {
      const glm::dvec3 corner = a.corners[k], span = a.corners[(k + 1) % a.corners.size()] - corner;
      glm::dvec3 n = glm::cross(a.inward, span);
      if (glm::length(n) <= 0.0)
        continue;
      n = glm::normalize(n);
      edges.push_back(plane_through(glm::dot(n, middle - corner) < 0.0 ? -n : n, corner));
    }
    planes.push_back({plane_through(a.inward, a.corners[0]), glm::vec4(a.transmittance, a.refractive_index),
                      glm::ivec4(first, static_cast<int>(edges.size()), 0, 0)});
  }
  if (planes.size() > kMaxApertures || edges.size() > kMaxApertureEdges)
    return Error{ErrorCode::limit_exceeded, std::to_string(planes.size()) + " windows and holes are too many to draw",
                 "room", "at most " + std::to_string(kMaxApertures) + ": merge neighbouring panes"};
  aperture_count_ = static_cast<int>(planes.size());
  apertures_ = make_buffer(gl_, padded(planes, kMaxApertures));
  aperture_edges_ = make_buffer(gl_, padded(edges, kMaxApertureEdges));
  return {};
}

Result<void> LightBlocks::set_lights(const LightSet& lights) {
  if (lights.size() > kMaxLights)
    return Error{ErrorCode::limit_exceeded, std::to_string(lights.size()) + " light samples", "renderer",
                 "at most " + std::to_string(kMaxLights)};
  std::vector<GpuLight> gpu_lights;
  sun_normal_irradiance_ = Rgb(0.0f);
  for (const auto* group : {&lights.sky, &lights.sun})
    for (const DirectionalLight& l : *group) {
      const OrthonormalBasis basis(l.direction);
      gpu_lights.push_back({glm::vec4(glm::vec3(basis.u), 0.0f), glm::vec4(glm::vec3(basis.v), 0.0f),
                            glm::vec4(glm::vec3(l.direction), 0.0f), glm::vec4(l.irradiance, 0.0f)});
      if (group == &lights.sun)
        sun_normal_irradiance_ += l.irradiance;
    }
  sky_lights_ = static_cast<int>(lights.sky.size());
  sun_lights_ = static_cast<int>(lights.sun.size());
  sky_cone_ = bounding_cone(lights.sky);
  sun_cone_ = bounding_cone(lights.sun);
  refill_buffer(gl_, lights_, padded(gpu_lights, kMaxLights));
  return check_gl(*gl_, "uploading lights");
}

void LightBlocks::bind() const {
  gl_->BindBufferBase(GL_UNIFORM_BUFFER, 0, lights_.name());
  gl_->BindBufferBase(GL_UNIFORM_BUFFER, 1, apertures_.name());
  gl_->BindBufferBase(GL_UNIFORM_BUFFER, 2, aperture_edges_.name());
}

void LightBlocks::set_uniforms(GLuint program) const {
  const auto at = [&](const char* name) { return gl_->GetUniformLocation(program, name); };
  gl_->ProgramUniform4fv(program, at("sky_cone"), 1, &sky_cone_.x);
  gl_->ProgramUniform4fv(program, at("sun_cone"), 1, &sun_cone_.x);
  gl_->ProgramUniform1i(program, at("sky_lights"), sky_lights_);
  gl_->ProgramUniform1i(program, at("sun_lights"), sun_lights_);
  gl_->ProgramUniform1i(program, at("aperture_count"), aperture_count_);
  gl_->ProgramUniform3fv(program, at("sun_normal_irradiance"), 1, &sun_normal_irradiance_.x);
}

} // namespace daylit
