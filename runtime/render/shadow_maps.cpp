#include "runtime/render/shadow_maps.h"

#include <algorithm>

#include <glm/vec3.hpp>

namespace daylit {

Result<ShadowMaps> ShadowMaps::make(const Gl& gl, int texels) {
  ShadowMaps maps;
  maps.gl_ = gl;
  maps.texels_ = texels;
  maps.framebuffer_ = make_framebuffer(gl);
  gl->NamedFramebufferDrawBuffer(maps.framebuffer_.name(), GL_NONE);
  gl->NamedFramebufferReadBuffer(maps.framebuffer_.name(), GL_NONE);
  if (const auto cleared = maps.clear(); !cleared)
    return cleared.error();
  return maps;
}

Result<void> ShadowMaps::allocate(int layers) {
  if (layers == layers_)
    return {};
  texture_ = make_texture(gl_, GL_TEXTURE_2D_ARRAY);
  gl_->TextureStorage3D(texture_.name(), 1, GL_DEPTH_COMPONENT32F, texels_, texels_, layers);
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
  if (const auto allocated = allocate(1); !allocated)
    return allocated;
  const float farthest = 1.0f;
  gl_->DepthMask(GL_TRUE);
  gl_->ClearNamedFramebufferfv(framebuffer_.name(), GL_DEPTH, 0, &farthest);
  return check_gl(*gl_, "shadow maps");
}

Result<void> ShadowMaps::draw(GLuint program, GLuint vertex_array, int vertices, bool indexed, int first, int count,
                              const BoundingSphere& sphere, double depth_extent) {
  if (count == 0 || vertices == 0)
    return clear();
  if (const auto allocated = allocate(count); !allocated)
    return allocated;
  const glm::vec3 centre(sphere.centre);
  gl_->ProgramUniform3fv(program, gl_->GetUniformLocation(program, "sphere_centre"), 1, &centre.x);
  gl_->ProgramUniform1f(program, gl_->GetUniformLocation(program, "sphere_radius"), static_cast<float>(sphere.radius));
  gl_->ProgramUniform1f(program, gl_->GetUniformLocation(program, "depth_extent"), static_cast<float>(depth_extent));
  const GLint light_index = gl_->GetUniformLocation(program, "light_index");

  gl_->BindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
  gl_->Viewport(0, 0, texels_, texels_);
  gl_->UseProgram(program);
  gl_->BindVertexArray(vertex_array);
  gl_->Enable(GL_DEPTH_TEST);
  gl_->DepthMask(GL_TRUE);
  gl_->DepthFunc(GL_LESS);
  const float farthest = 1.0f;
  for (int k = 0; k < count; ++k) {
    // One draw per layer is the fastest variant in software and needs no layer output from the vertex stage.
    gl_->NamedFramebufferTextureLayer(framebuffer_.name(), GL_DEPTH_ATTACHMENT, texture_.name(), 0, k);
    gl_->ClearNamedFramebufferfv(framebuffer_.name(), GL_DEPTH, 0, &farthest);
    gl_->ProgramUniform1i(program, light_index, first + k);
    if (indexed)
      gl_->DrawElements(GL_TRIANGLES, vertices, GL_UNSIGNED_INT, nullptr);
    else
      gl_->DrawArrays(GL_TRIANGLES, 0, vertices);
  }
  return check_gl(*gl_, "shadow maps");
}

} // namespace daylit
