#include "runtime/gl/shadow_maps.h"

namespace daylit {

Result<ShadowMaps> ShadowMaps::make(const Gl& gl, int texels) {
  ShadowMaps maps;
  maps.gl_ = gl;
  maps.texels_ = texels;
  maps.framebuffer_ = make_framebuffer(gl);
  gl->NamedFramebufferDrawBuffer(maps.framebuffer_.name(), GL_NONE);
  gl->NamedFramebufferReadBuffer(maps.framebuffer_.name(), GL_NONE);
  if (const auto allocated = maps.allocate(1); !allocated)
    return allocated.error();
  return maps;
}

Result<void> ShadowMaps::allocate(int layers) {
  texture_ = make_texture(gl_, GL_TEXTURE_2D_ARRAY);
  // A quantum is small beside a texel, by which receivers are lifted.
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

Result<void> ShadowMaps::draw(const GlProgram& program, const ShadowCaster& caster, std::span<const PortalLight> lights,
                              float half_depth) {
  if (static_cast<int>(lights.size()) > layers_)
    if (const auto allocated = allocate(static_cast<int>(lights.size())); !allocated)
      return allocated;
  const GLint toward = gl_->GetUniformLocation(program.name(), "toward_light");
  gl_->ProgramUniform1f(program.name(), gl_->GetUniformLocation(program.name(), "half_depth"), half_depth);
  gl_->BindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
  gl_->Viewport(0, 0, texels_, texels_);
  gl_->UseProgram(program.name());
  gl_->BindVertexArray(caster.vertex_array);
  gl_->Enable(GL_DEPTH_TEST);
  gl_->DepthFunc(GL_LESS);
  gl_->DepthMask(GL_TRUE);
  constexpr float kFarthest = 1.0f;
  for (std::size_t k = 0; k < lights.size(); ++k) {
    gl_->NamedFramebufferTextureLayer(framebuffer_.name(), GL_DEPTH_ATTACHMENT, texture_.name(), 0,
                                      static_cast<GLint>(k));
    gl_->ClearNamedFramebufferfv(framebuffer_.name(), GL_DEPTH, 0, &kFarthest);
    gl_->ProgramUniform3fv(program.name(), toward, 1, &lights[k].direction.x);
    if (caster.indexed)
      gl_->DrawElements(GL_TRIANGLES, caster.vertices, GL_UNSIGNED_INT, nullptr);
    else if (caster.vertices > 0)
      gl_->DrawArrays(GL_TRIANGLES, 0, caster.vertices);
  }
  return check_gl(*gl_, "shadow maps");
}

} // namespace daylit
