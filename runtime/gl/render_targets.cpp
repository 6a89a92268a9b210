#include "runtime/gl/render_targets.h"

#include <algorithm>
#include <string>

namespace daylit {

namespace {

GlTexture make_picture_texture(const Gl& gl, int width, int height, GLenum format, int samples = 0) {
  GlTexture texture = make_texture(gl, samples > 0 ? GL_TEXTURE_2D_MULTISAMPLE : GL_TEXTURE_2D);
  if (samples > 0)
    gl->TextureStorage2DMultisample(texture.name(), samples, format, width, height, GL_TRUE);
  else
    gl->TextureStorage2D(texture.name(), 1, format, width, height);
  return texture;
}

Result<GlFramebuffer> make_id_target(const Gl& gl, const GlTexture& ids, const GlTexture& depths) {
  GlFramebuffer target = make_framebuffer(gl);
  gl->NamedFramebufferTexture(target.name(), GL_COLOR_ATTACHMENT0, ids.name(), 0);
  gl->NamedFramebufferTexture(target.name(), GL_DEPTH_ATTACHMENT, depths.name(), 0);
  if (const auto r = check_framebuffer(gl, target, "render targets"); !r)
    return r.error();
  return target;
}

/// Each pass is a layer of one texture, so that one call reads them all.
Result<GlFramebuffer> make_layered_target(const Gl& gl, const GlTexture& picture, int layers) {
  GlFramebuffer target = make_framebuffer(gl);
  std::vector<GLenum> attachments;
  for (int k = 0; k < layers; ++k) {
    attachments.push_back(GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(k));
    gl->NamedFramebufferTextureLayer(target.name(), attachments.back(), picture.name(), 0, k);
  }
  gl->NamedFramebufferDrawBuffers(target.name(), layers, attachments.data());
  if (const auto r = check_framebuffer(gl, target, "render targets"); !r)
    return r.error();
  return target;
}

} // namespace

Result<RenderTargets> RenderTargets::make(const Gl& gl, int width, int height, int samples) {
  GLint sides = 0;
  gl->GetIntegerv(GL_MAX_TEXTURE_SIZE, &sides);
  if (width <= 0 || height <= 0 || std::max(width, height) > sides)
    return Error{ErrorCode::limit_exceeded,
                 "a picture of " + std::to_string(width) + " x " + std::to_string(height) + " cannot be drawn",
                 "renderer", "the driver's limit is " + std::to_string(sides) + " pixels a side"};
  RenderTargets t;
  t.gl_ = gl;
  t.width_ = width;
  t.height_ = height;
  t.room_ids_ = make_picture_texture(gl, width, height, GL_R32F);
  t.room_depths_ = make_picture_texture(gl, width, height, GL_DEPTH_COMPONENT32F);
  t.object_ids_ = make_picture_texture(gl, width, height, GL_R32F, samples);
  t.object_depths_ = make_picture_texture(gl, width, height, GL_DEPTH_COMPONENT32F, samples);
  t.picture_ = make_texture(gl, GL_TEXTURE_2D_ARRAY);
  gl->TextureStorage3D(t.picture_.name(), 1, GL_RGBA32F, width, height, kPasses);
  auto room = make_id_target(gl, t.room_ids_, t.room_depths_);
  auto objects = make_id_target(gl, t.object_ids_, t.object_depths_);
  auto lit = make_layered_target(gl, t.picture_, kPasses);
  for (const auto* made : {&room, &objects, &lit})
    if (!*made)
      return made->error();
  t.room_ = std::move(*room);
  t.objects_ = std::move(*objects);
  t.lit_ = std::move(*lit);
  return t;
}

void RenderTargets::start_ids(const GlFramebuffer& target) const {
  constexpr float kNone[4] = {}, kFarthest = 0.0f; // depths: near plane by distance
  gl_->BindFramebuffer(GL_FRAMEBUFFER, target.name());
  gl_->Viewport(0, 0, width_, height_);
  gl_->Enable(GL_DEPTH_TEST);
  gl_->DepthMask(GL_TRUE);
  gl_->DepthFunc(GL_GREATER);
  gl_->ClearNamedFramebufferfv(target.name(), GL_COLOR, 0, kNone);
  gl_->ClearNamedFramebufferfv(target.name(), GL_DEPTH, 0, &kFarthest);
}

void RenderTargets::start_room_ids() const { start_ids(room_); }
void RenderTargets::start_object_ids() const { start_ids(objects_); }

void RenderTargets::start_picture() const {
  gl_->BindFramebuffer(GL_FRAMEBUFFER, lit_.name());
  gl_->Viewport(0, 0, width_, height_);
  gl_->Disable(GL_DEPTH_TEST);
}

Result<void> RenderTargets::read_picture(std::vector<glm::vec4>& texels) const {
  texels.resize(static_cast<std::size_t>(kPasses) * static_cast<std::size_t>(width_) *
                static_cast<std::size_t>(height_));
  gl_->GetTextureImage(picture_.name(), 0, GL_RGBA, GL_FLOAT, static_cast<GLsizei>(texels.size() * sizeof(glm::vec4)),
                       texels.data());
  return check_gl(*gl_, "reading the picture back");
}

} // namespace daylit
