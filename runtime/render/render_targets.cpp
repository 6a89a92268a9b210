#include "runtime/render/render_targets.h"

#include <algorithm>

namespace daylit {

namespace {
constexpr GLenum kAttachments[] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1, GL_COLOR_ATTACHMENT2};
}

Result<RenderTargets> RenderTargets::make(const Gl& gl, int width, int height, int samples) {
  GLint limit = 0, sides = 0;
  gl->GetIntegerv(GL_MAX_COLOR_TEXTURE_SAMPLES, &limit);
  gl->GetIntegerv(GL_MAX_TEXTURE_SIZE, &sides);
  if (width <= 0 || height <= 0 || std::max(width, height) > sides)
    return Error{ErrorCode::limit_exceeded,
                 "a picture of " + std::to_string(width) + " x " + std::to_string(height) + " cannot be drawn",
                 "renderer", "the driver's limit is " + std::to_string(sides) + " pixels a side"};
  RenderTargets t;
  t.gl_ = gl;
  t.width_ = width;
  t.height_ = height;
  t.multi_ = make_framebuffer(gl);
  t.single_ = make_framebuffer(gl);
  const int per_pixel = std::clamp(samples, 1, static_cast<int>(limit));
  for (int k = 0; k < kColours; ++k) {
    t.multi_colour_[k] = make_texture(gl, GL_TEXTURE_2D_MULTISAMPLE);
    gl->TextureStorage2DMultisample(t.multi_colour_[k].name(), per_pixel, GL_RGBA32F, width, height, GL_TRUE);
    gl->NamedFramebufferTexture(t.multi_.name(), kAttachments[k], t.multi_colour_[k].name(), 0);
    t.single_colour_[k] = make_texture(gl, GL_TEXTURE_2D);
    gl->TextureStorage2D(t.single_colour_[k].name(), 1, GL_RGBA32F, width, height);
    gl->NamedFramebufferTexture(t.single_.name(), kAttachments[k], t.single_colour_[k].name(), 0);
  }
  t.multi_depth_ = make_texture(gl, GL_TEXTURE_2D_MULTISAMPLE);
  gl->TextureStorage2DMultisample(t.multi_depth_.name(), per_pixel, GL_DEPTH_COMPONENT32F, width, height, GL_TRUE);
  gl->NamedFramebufferTexture(t.multi_.name(), GL_DEPTH_ATTACHMENT, t.multi_depth_.name(), 0);
  gl->NamedFramebufferDrawBuffers(t.multi_.name(), kColours, kAttachments);
  if (const auto r = check_framebuffer(gl, t.multi_, "render targets"); !r)
    return r.error();
  if (const auto r = check_framebuffer(gl, t.single_, "render targets"); !r)
    return r.error();
  return t;
}

void RenderTargets::bind_and_clear() const {
  const float zero[4] = {0.0f, 0.0f, 0.0f, 0.0f};
  gl_->DepthMask(GL_TRUE);
  gl_->BindFramebuffer(GL_FRAMEBUFFER, multi_.name());
  gl_->Viewport(0, 0, width_, height_);
  for (int k = 0; k < kColours; ++k)
    gl_->ClearNamedFramebufferfv(multi_.name(), GL_COLOR, k, zero);
  gl_->ClearNamedFramebufferfv(multi_.name(), GL_DEPTH, 0, zero); // reversed depth: 0 is infinitely far
}

void RenderTargets::resolve() const {
  for (const GLenum attachment : kAttachments) {
    gl_->NamedFramebufferReadBuffer(multi_.name(), attachment);
    gl_->NamedFramebufferDrawBuffer(single_.name(), attachment);
    gl_->BlitNamedFramebuffer(multi_.name(), single_.name(), 0, 0, width_, height_, 0, 0, width_, height_,
                              GL_COLOR_BUFFER_BIT, GL_NEAREST);
  }
}

Result<std::vector<glm::vec4>> RenderTargets::read(int colour) const {
  std::vector<glm::vec4> pixels(static_cast<std::size_t>(width_) * height_);
  gl_->GetTextureImage(single_colour_[colour].name(), 0, GL_RGBA, GL_FLOAT,
                       static_cast<GLsizei>(pixels.size() * sizeof(glm::vec4)), pixels.data());
  if (const auto r = check_gl(*gl_, "reading the picture back"); !r)
    return r.error();
  return pixels;
}

} // namespace daylit
