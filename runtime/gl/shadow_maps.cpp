#include "runtime/gl/shadow_maps.h"

#include <algorithm>

#include <glm/vec3.hpp>

namespace daylit {

Result<ShadowMaps> ShadowMaps::make(const Gl& gl, int texels, bool by_processor) {
  ShadowMaps maps;
  maps.gl_ = gl;
  maps.texels_ = texels;
  maps.by_processor_ = by_processor;
  maps.framebuffer_ = make_framebuffer(gl);
  gl->NamedFramebufferDrawBuffer(maps.framebuffer_.name(), GL_NONE);
  gl->NamedFramebufferReadBuffer(maps.framebuffer_.name(), GL_NONE);
  if (const auto cleared = maps.clear(); !cleared)
    return cleared.error();
  return maps;
}

Result<void> ShadowMaps::allocate(int layers) {
  texture_ = make_texture(gl_, GL_TEXTURE_2D_ARRAY);
  // A quantum is small beside a texel, by which receivers are lifted; handing over floats takes llvmpipe fifteen times
  // as long.
  gl_->TextureStorage3D(texture_.name(), 1, GL_DEPTH_COMPONENT16, texels_, texels_, layers);
  const std::pair<GLenum, GLenum> parameters[] = {{GL_TEXTURE_MIN_FILTER, GL_LINEAR},
                                                  {GL_TEXTURE_MAG_FILTER, GL_LINEAR},
                                                  {GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE},
                                                  {GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE},
                                                  {GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE},
                                                  {GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL}};
  for (const auto& [name, value] : parameters)
    gl_->TextureParameteri(texture_.name(), name, static_cast<GLint>(value));
  layers_ = layers;
  gl_->NamedFramebufferTextureLayer(framebuffer_.name(), GL_DEPTH_ATTACHMENT, texture_.name(), 0, 0);
  return check_framebuffer(gl_, framebuffer_, "shadow maps");
}

Result<void> ShadowMaps::clear() {
  if (layers_ != 1)
    if (const auto allocated = allocate(1); !allocated)
      return allocated;
  const float farthest = 1.0f;
  gl_->DepthMask(GL_TRUE);
  gl_->ClearNamedFramebufferfv(framebuffer_.name(), GL_DEPTH, 0, &farthest);
  return check_gl(*gl_, "shadow maps");
}

Result<void> ShadowMaps::draw(GLuint program, const ShadowCaster& caster, std::span<const MapAxes> lights,
                              const glm::vec3& centre) {
  if (lights.empty() || caster.vertices == 0)
    return clear();
  if (static_cast<int>(lights.size()) > layers_)
    if (const auto allocated = allocate(static_cast<int>(lights.size())); !allocated)
      return allocated;
  if (by_processor_) {
    DepthRaster mesh = caster.mesh;
    mesh.texels = texels_;
    depths_.resize(lights.size() * static_cast<std::size_t>(texels_) * static_cast<std::size_t>(texels_));
    mesh.draw(lights, depths_);
    gl_->TextureSubImage3D(texture_.name(), 0, 0, 0, 0, texels_, texels_, static_cast<GLsizei>(lights.size()),
                           GL_DEPTH_COMPONENT, GL_UNSIGNED_SHORT, depths_.data());
    return check_gl(*gl_, "shadow maps");
  }
  const auto at = [&](const char* name) { return gl_->GetUniformLocation(program, name); };
  gl_->ProgramUniform3fv(program, at("sphere_centre"), 1, &centre.x);
  gl_->ProgramUniform1f(program, at("sphere_radius"), caster.mesh.half_width);
  gl_->ProgramUniform1f(program, at("depth_extent"), caster.mesh.half_depth);
  const GLint right = at("right"), up = at("up"), toward = at("toward");
  gl_->BindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
  gl_->Viewport(0, 0, texels_, texels_);
  gl_->UseProgram(program);
  gl_->BindVertexArray(caster.vertex_array);
  gl_->Enable(GL_DEPTH_TEST);
  gl_->DepthFunc(GL_LESS);
  gl_->DepthMask(GL_TRUE);
  const float farthest = 1.0f;
  for (std::size_t k = 0; k < lights.size(); ++k) {
    gl_->NamedFramebufferTextureLayer(framebuffer_.name(), GL_DEPTH_ATTACHMENT, texture_.name(), 0,
                                      static_cast<GLint>(k));
    gl_->ClearNamedFramebufferfv(framebuffer_.name(), GL_DEPTH, 0, &farthest);
    gl_->ProgramUniform3fv(program, right, 1, &lights[k].right.x);
    gl_->ProgramUniform3fv(program, up, 1, &lights[k].up.x);
    gl_->ProgramUniform3fv(program, toward, 1, &lights[k].toward.x);
    if (caster.indexed)
      gl_->DrawElements(GL_TRIANGLES, caster.vertices, GL_UNSIGNED_INT, nullptr);
    else
      gl_->DrawArrays(GL_TRIANGLES, 0, caster.vertices);
  }
  return check_gl(*gl_, "shadow maps");
}

} // namespace daylit
