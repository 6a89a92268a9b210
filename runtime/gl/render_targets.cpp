#include "runtime/gl/render_targets.h"

#include <algorithm>
#include <string>

namespace daylit {

namespace {

GlTexture make_picture_texture(const Gl& gl, int width, int height, GLenum format, int samples) {
  GlTexture texture = make_texture(gl, samples > 0 ? GL_TEXTURE_2D_MULTISAMPLE : GL_TEXTURE_2D);
  if (samples > 0) {
    gl->TextureStorage2DMultisample(texture.name(), samples, format, width, height, GL_TRUE);
  } else {
    gl->TextureStorage2D(texture.name(), 1, format, width, height);
    gl->TextureParameteri(texture.name(), GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    gl->TextureParameteri(texture.name(), GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  }
  return texture;
}

} // namespace

Result<DrawTarget> DrawTarget::make(const Gl& gl, int width, int height, GLenum format, int colours, GLuint depth,
                                    int samples) {
  DrawTarget t;
  t.gl_ = gl;
  t.width_ = width;
  t.height_ = height;
  t.framebuffer_ = make_framebuffer(gl);
  std::vector<GLenum> attachments;
  for (int k = 0; k < colours; ++k) {
    attachments.push_back(GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(k));
    t.colours_.push_back(make_picture_texture(gl, width, height, format, samples));
    gl->NamedFramebufferTexture(t.framebuffer_.name(), attachments.back(), t.colours_.back().name(), 0);
  }
  if (depth)
    gl->NamedFramebufferTexture(t.framebuffer_.name(), GL_DEPTH_ATTACHMENT, depth, 0);
  gl->NamedFramebufferDrawBuffers(t.framebuffer_.name(), colours, attachments.data());
  if (const auto r = check_framebuffer(gl, t.framebuffer_, "render targets"); !r)
    return r.error();
  return t;
}

void DrawTarget::bind() const {
  gl_->BindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
  gl_->Viewport(0, 0, width_, height_);
}

void DrawTarget::clear_colours() const {
  const float zero[4] = {0.0f, 0.0f, 0.0f, 0.0f};
  for (int k = 0; k < static_cast<int>(colours_.size()); ++k)
    gl_->ClearNamedFramebufferfv(framebuffer_.name(), GL_COLOR, k, zero);
}

void DrawTarget::clear_depth() const {
  const float zero = 0.0f;
  gl_->DepthMask(GL_TRUE);
  gl_->ClearNamedFramebufferfv(framebuffer_.name(), GL_DEPTH, 0, &zero);
}

Result<void> DrawTarget::read(int k, const PixelBox& box, std::vector<glm::vec4>& texels) const {
  texels.resize(static_cast<std::size_t>(box.width()) * static_cast<std::size_t>(box.height()));
  if (texels.empty())
    return {};
  gl_->GetTextureSubImage(texture(k), 0, box.x0, box.y0, 0, box.width(), box.height(), 1, GL_RGBA, GL_FLOAT,
                          static_cast<GLsizei>(texels.size() * sizeof(glm::vec4)), texels.data());
  return check_gl(*gl_, "reading the picture back");
}

Result<void> DrawTarget::read(int k, std::vector<float>& texels) const {
  texels.resize(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  gl_->GetTextureImage(texture(k), 0, GL_RED, GL_FLOAT, static_cast<GLsizei>(texels.size() * sizeof(float)),
                       texels.data());
  return check_gl(*gl_, "reading the picture back");
}

Result<RenderTargets> RenderTargets::make(const Gl& gl, int width, int height, int samples, bool room_blocks,
                                          bool ids_by_processor) {
  GLint sides = 0;
  gl->GetIntegerv(GL_MAX_TEXTURE_SIZE, &sides);
  RenderTargets t;
  t.width_px = width;
  t.height_px = height;
  if (width <= 0 || height <= 0 || std::max(width, height) > sides - 3)
    return Error{ErrorCode::limit_exceeded,
                 "a picture of " + std::to_string(width) + " x " + std::to_string(height) + " cannot be drawn",
                 "renderer", "the driver's limit is " + std::to_string(sides) + " pixels a side"};
  t.room_depth = make_picture_texture(gl, width, height, GL_DEPTH_COMPONENT32F, 0);
  t.object_marks = make_picture_texture(gl, width, height, GL_DEPTH_COMPONENT32F, 0);
  t.asked_width = (width + 3) / 4 * 4;
  t.asked_height = (height + 3) / 4 * 4;
  t.ids_by_processor = ids_by_processor;
  if (ids_by_processor) {
    t.object_samples = make_picture_texture(gl, t.asked_width, height, GL_RGBA32F, 0);
    t.object_shown = make_picture_texture(gl, t.asked_width, height, GL_R32F, 0);
  } else {
    t.object_depth = make_picture_texture(gl, width, height, GL_DEPTH_COMPONENT32F, samples);
    auto ids = DrawTarget::make(gl, width, height, GL_R32F, 1, t.object_depth.name(), samples);
    if (!ids)
      return ids.error();
    t.object_ids = std::move(*ids);
  }
  t.asked_offsets = make_picture_texture(gl, t.asked_width, t.asked_height, GL_RGBA32F, 0);
  t.asked_normals = make_picture_texture(gl, t.asked_width, t.asked_height, GL_RGBA32F, 0);
  const int sums = room_blocks ? 3 : 2;
  struct Entry {
    DrawTarget* target;
    int width, height;
    GLenum format;
    int colours;
    GLuint depth;
  };
  const GLuint points = t.object_marks.name();
  const Entry entries[] = {{&t.room_ids, width, height, GL_R32F, 1, t.room_depth.name()},
                           {&t.object_points, width, height, GL_RGBA32F, 2, points},
                           {&t.object_picture, width, height, GL_RGBA32F, 1, points},
                           {&t.object_sky.target, width, height, GL_RGBA32F, sums, points},
                           {&t.object_sun.target, width, height, GL_RGBA32F, sums, points},
                           {&t.asked.target, t.asked_width, t.asked_height, GL_RGBA32F, sums, 0}};
  for (const Entry& e : entries) {
    auto made = DrawTarget::make(gl, e.width, e.height, e.format, e.colours, e.depth);
    if (!made)
      return made.error();
    *e.target = std::move(*made);
  }
  for (LightSums* s : {&t.object_sky, &t.object_sun, &t.asked})
    s->room_blocks = room_blocks;
  return t;
}

} // namespace daylit
