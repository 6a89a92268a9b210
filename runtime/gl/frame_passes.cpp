#include "runtime/gl/frame_passes.h"

#include <algorithm>
#include <string>

#include "runtime/gl/shaders.h"
#include "runtime/shading/visibility.h"

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

// Parts of a pixel that lie further apart in depth than this fraction of the objects' radius are lit separately.
constexpr float kApart = 0.04f;

// std140 layout of shaders/frame.glsl.
struct FrameBlock {
  glm::mat4 clip_from_scene;
  glm::vec4 eye, ray_corner, ray_right, ray_down, sphere, sky_cone, sun_cone, sun_normal_irradiance, maps;
  std::int32_t lights[4];
};

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

Result<FramePasses> FramePasses::make(const Gl& gl, int map_texels, int samples, bool room_occludes) {
  using namespace shaders;
  FramePasses p;
  p.gl_ = gl;
  p.map_texels_ = map_texels;
  p.room_occludes_ = room_occludes;
  const std::string definitions = "#define SAMPLES " + std::to_string(samples) + "\n#define ROOM_OCCLUDES " +
                                  (room_occludes ? "1" : "0") + "\n#define APART " + std::to_string(kApart) +
                                  "\n#define SHARP " + std::to_string(kSharpEdge) + "\n";
  struct Entry {
    GlProgram* program;
    const char* name;
    std::vector<const char*> vertex, fragment;
  };
  const Entry entries[] = {
      {&p.shadow_, "shadow", {frame, light_axes, shadow_vertex}, {depth_fragment}},
      {&p.ids_, "ids", {frame, scene_vertex}, {id_fragment}},
      {&p.picture_,
       "picture",
       {whole_vertex},
       {definitions.c_str(), frame, light_axes, portal_lights, light_sums, object_surface, picture_fragment}}};
  for (const Entry& e : entries) {
    auto program = make_program(gl, e.name, e.vertex, e.fragment);
    if (!program)
      return program.error();
    *e.program = std::move(*program);
  }
  for (ShadowMaps* maps : {&p.object_maps_, &p.room_maps_}) {
    auto made = ShadowMaps::make(gl, map_texels);
    if (!made)
      return made.error();
    *maps = std::move(*made);
  }
  p.nothing_ = make_vertex_array(gl, {}, {});
  p.frame_ = make_buffer(gl, {});
  gl->ProgramUniform1f(p.picture_.name(), gl->GetUniformLocation(p.picture_.name(), "near_plane"),
                       static_cast<float>(kNearPlane_m));
  return p;
}

void FramePasses::set_frame(const PinholeCamera& camera, const glm::dvec3& origin, const BoundingSphere& sphere,
                            float room_half_depth, const FrameLights& lights) {
  const PixelRays rays(camera, origin);
  const auto vector = [](const glm::vec3& v, float w = 0.0f) { return glm::vec4(v, w); };
  FrameBlock f{};
  f.clip_from_scene = camera.clip_from_scene(origin);
  f.eye = vector(rays.eye);
  f.ray_corner = vector(rays.corner);
  f.ray_right = vector(rays.right);
  f.ray_down = vector(rays.down);
  f.sphere = vector(glm::vec3(sphere.centre), static_cast<float>(sphere.radius));
  f.sky_cone = vector(lights.sky_cone.axis, lights.sky_cone.cosine);
  f.sun_cone = vector(lights.sun_cone.axis, lights.sun_cone.cosine);
  f.sun_normal_irradiance = vector(lights.sun_normal_irradiance);
  f.maps = glm::vec4(static_cast<float>(map_texels_), room_half_depth, 0.0f, 0.0f);
  f.lights[0] = static_cast<std::int32_t>(lights.sky_count);
  f.lights[1] = static_cast<std::int32_t>(lights.lights.size());
  object_half_depth_ = static_cast<float>(sphere.radius);
  room_half_depth_ = room_half_depth;
  refill_buffer(gl_, frame_, std::as_bytes(std::span<const FrameBlock>(&f, 1)));
  gl_->BindBufferBase(GL_UNIFORM_BUFFER, 0, frame_.name());
}

Result<void> FramePasses::draw_shadow_maps(const RoomBuffers& room, const ObjectBuffers& objects,
                                           const FrameLights& lights) {
  if (room_occludes_)
    if (const auto drawn = room_maps_.draw(shadow_, room.occluder(), lights.lights.lights(), room_half_depth_); !drawn)
      return drawn;
  return object_maps_.draw(shadow_, objects.caster(), lights.lights.lights(), object_half_depth_);
}

/// Openings first, for their depths only: pixels that show what is beyond keep the id 0.
void FramePasses::draw_room_ids(const RoomBuffers& room, const glm::vec3& eye, const RenderTargets& targets) const {
  targets.start_room_ids();
  gl_->UseProgram(ids_.name());
  gl_->ColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  room.draw_openings(gl_, eye);
  gl_->ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  room.draw(gl_);
}

/// The room is drawn first, for its depths only.
void FramePasses::draw_object_ids(const RoomBuffers& room, const ObjectBuffers& objects,
                                  const RenderTargets& targets) const {
  targets.start_object_ids();
  gl_->UseProgram(ids_.name());
  gl_->ColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  room.draw(gl_);
  gl_->ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  objects.draw(gl_);
}

void FramePasses::light_picture(const RoomBuffers& room, const ObjectBuffers& objects, const LightBuffers& lights,
                                const RenderTargets& targets) const {
  targets.start_picture();
  const GLuint textures[] = {targets.room_ids(), targets.object_ids(), object_maps_.texture(), room_maps_.texture(),
                             targets.object_depths()};
  for (GLuint unit = 0; unit < std::size(textures); ++unit)
    gl_->BindTextureUnit(unit, textures[unit]);
  lights.bind(gl_);
  room.bind(gl_);
  objects.bind(gl_);
  gl_->UseProgram(picture_.name());
  gl_->BindVertexArray(nothing_.name());
  gl_->DrawArrays(GL_TRIANGLES, 0, 3);
}

} // namespace daylit
