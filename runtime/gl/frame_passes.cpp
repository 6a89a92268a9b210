#include "runtime/gl/frame_passes.h"

#include <string>

#include "runtime/gl/shaders.h"

namespace daylit {

namespace {

// Parts of a pixel that lie further apart in depth than this fraction of the objects' radius are lit separately.
constexpr float kApart = 0.04f;

// std140 layout of shaders/frame.glsl.
struct FrameBlock {
  glm::mat4 clip_from_scene;
  glm::vec4 eye, ray_corner, ray_right, ray_down, sphere, sky_cone, sun_cone, sun_normal_irradiance, maps;
  std::int32_t lights[4];
};

} // namespace

Result<FramePasses> FramePasses::make(const Gl& gl, int map_texels, int samples, bool room_occludes) {
  using namespace shaders;
  FramePasses p;
  p.gl_ = gl;
  p.map_texels_ = map_texels;
  p.room_occludes_ = room_occludes;
  const std::string definitions = "#define SAMPLES " + std::to_string(samples) + "\n#define ROOM_OCCLUDES " +
                                  (room_occludes ? "1" : "0") + "\n#define APART " + std::to_string(kApart) + "\n";
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

void FramePasses::set_frame(const RenderCamera& camera, const glm::dvec3& origin, const BoundingSphere& sphere,
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

void FramePasses::draw_room_ids(const RoomBuffers& room, const RenderTargets& targets) const {
  targets.start_room_ids();
  gl_->UseProgram(ids_.name());
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
