#include "runtime/render/picture_passes.h"

#include "runtime/render/shaders.h"

namespace daylit {

namespace {

constexpr int kTileColumns = 2, kTileRows = 2; // shaders/whole_fragment.glsl
static_assert(kTileColumns * kTileRows == LightBatches::kSets);

// std140 layout of shaders/frame.glsl.
struct GpuFrame {
  glm::mat4 clip_from_scene;
  glm::vec4 eye, ray_corner, ray_right, ray_down, sphere, sky_cone, sun_cone, sun_normal_irradiance;
  glm::ivec4 tile_size;
};

PixelBox tile_box(int tile, const RenderTargets& t) {
  const int x = tile % kTileColumns * t.tile_width, y = tile / kTileColumns * t.tile_height;
  return {x, y, x + t.tile_width, y + t.tile_height};
}

} // namespace

Result<void> PicturePasses::build(const std::string& definitions) {
  using namespace shaders;
  struct Entry {
    GlProgram* program;
    const char* name;
    std::vector<const char*> vertex, fragment; ///< after the definitions
  };
  constexpr const char *kOwn = "#define OWN_SHADOW true\n", *kOther = "#define OWN_SHADOW false\n";
  constexpr const char *kWhole = "#define MIXED 0\n", *kMixed = "#define MIXED 1\n";
  const std::vector<const char*> whole{frame, marks, windows, whole_vertex};
  const std::vector<const char*> light{frame, marks, windows, light_batch, light_vertex};
  const Entry entries[] = {
      {&shadow_, "shadow", {shadow_vertex}, {depth_fragment}},
      {&ids_, "ids", {frame, scene_vertex}, {id_fragment}},
      {&object_points_, "object points", whole, {whole_fragment, marks, object_surface, object_point_fragment}},
      {&object_light_, "object light", light, {kOwn, windows, light_batch, light_fragment}},
      {&object_picture_, "objects", whole, {kWhole, whole_fragment, object_surface, share, object_picture_fragment}},
      {&object_edges_, "edges", whole, {kMixed, whole_fragment, object_surface, share, object_picture_fragment}},
      {&room_points_, "room points", whole, {whole_fragment, windows, room_point_fragment}},
      {&room_light_, "room light", light, {kOther, windows, light_batch, light_fragment}},
      {&room_picture_, "room", whole, {whole_fragment, share, room_picture_fragment}}};
  const std::string vertex = definitions + "#define VERTEX 1\n", fragment = definitions + "#define VERTEX 0\n";
  for (Entry e : entries) {
    e.vertex.insert(e.vertex.begin(), vertex.c_str());
    e.fragment.insert(e.fragment.begin(), fragment.c_str());
    auto program = make_program(gl_, e.name, e.vertex, e.fragment);
    if (!program)
      return program.error();
    *e.program = std::move(*program);
  }
  return {};
}

Result<PicturePasses> PicturePasses::make(const Gl& gl, const std::string& light_definitions, int samples,
                                          bool room_blocks) {
  PicturePasses p;
  p.gl_ = gl;
  const std::string definitions = light_definitions + "#define SAMPLES " + std::to_string(samples) +
                                  "\n#define ROOM_OCCLUDES " + (room_blocks ? "1" : "0") + "\n";
  if (const auto built = p.build(definitions); !built)
    return built.error();
  p.nothing_ = make_vertex_array(gl, {}, 0);
  p.frame_ = make_buffer(gl, {});
  gl->ProgramUniform1f(p.object_points_.name(), gl->GetUniformLocation(p.object_points_.name(), "near_plane"),
                       static_cast<float>(kNearPlane_m));
  gl->ProgramUniform1i(p.room_points_.name(), gl->GetUniformLocation(p.room_points_.name(), "pass"), 1);
  gl->ProgramUniform1i(p.object_edges_.name(), gl->GetUniformLocation(p.object_edges_.name(), "pass"), 2);
  return p;
}

void PicturePasses::set_frame(const RenderCamera& camera, const glm::dvec3& origin, const BoundingSphere& sphere,
                              double room_extent, const LightBatches& lights, const RenderTargets& targets) {
  const glm::dmat3 axes(camera.world_from_camera);
  const glm::dvec3 right = axes[0] / camera.fx, down = axes[1] / camera.fy;
  const auto vector = [](const glm::dvec3& v) { return glm::vec4(glm::vec3(v), 0.0f); };
  GpuFrame f;
  f.clip_from_scene = camera.clip_from_scene(origin);
  f.eye = vector(camera.eye() - origin);
  f.ray_corner = vector(axes[2] - camera.cx * right - camera.cy * down);
  f.ray_right = vector(right);
  f.ray_down = vector(down);
  f.sphere = glm::vec4(glm::vec3(sphere.centre), static_cast<float>(sphere.radius));
  f.sky_cone = lights.sky().cone;
  f.sun_cone = lights.sun().cone;
  f.sun_normal_irradiance = glm::vec4(lights.sun_normal_irradiance(), 0.0f);
  f.tile_size = {targets.tile_width, targets.tile_height, 0, 0};
  room_extent_ = static_cast<float>(room_extent);
  refill_buffer(gl_, frame_, std::as_bytes(std::span<const GpuFrame>(&f, 1)));
  gl_->BindBufferBase(GL_UNIFORM_BUFFER, 3, frame_.name());
  lights.bind_windows();
}

void PicturePasses::bind(GLuint first_unit, std::initializer_list<GLuint> textures) const {
  for (const GLuint texture : textures)
    gl_->BindTextureUnit(first_unit++, texture);
}

void PicturePasses::scissor(const PixelBox& box) const {
  gl_->Enable(GL_SCISSOR_TEST);
  gl_->Scissor(box.x0, box.y0, box.width(), box.height());
}

void PicturePasses::draw_whole(const GlProgram& program) const {
  gl_->UseProgram(program.name());
  gl_->BindVertexArray(nothing_.name());
  gl_->DrawArrays(GL_TRIANGLES, 0, 3);
}

template <class Draw>
void PicturePasses::by_tiles(const GlProgram& program, const RenderTargets& t, const Draw& draw) const {
  const GLint tile = gl_->GetUniformLocation(program.name(), "this_tile");
  for (int k = 0; k < LightBatches::kSets; ++k) {
    scissor(tile_box(k, t));
    if (tile >= 0)
      gl_->ProgramUniform2i(program.name(), tile, k % kTileColumns, k / kTileColumns);
    draw(k);
  }
  gl_->Disable(GL_SCISSOR_TEST);
}

void PicturePasses::show_room(const RoomBuffers& room, const RenderTargets& t) const {
  t.room_ids.bind();
  t.room_ids.clear_colours();
  t.room_ids.clear_depth();
  gl_->Enable(GL_DEPTH_TEST);
  gl_->DepthFunc(GL_GREATER);
  gl_->UseProgram(ids_.name());
  room.draw(gl_);
}

void PicturePasses::show_objects(const RoomBuffers& room, const ObjectBuffers& objects, const PixelBox& box,
                                 const RenderTargets& t) const {
  scissor(box);
  t.object_ids.bind();
  t.object_ids.clear_colours();
  t.object_ids.clear_depth();
  gl_->Enable(GL_DEPTH_TEST);
  gl_->DepthFunc(GL_GREATER);
  gl_->UseProgram(ids_.name());
  gl_->ColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  room.draw(gl_);
  gl_->ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  objects.draw(gl_);

  t.object_points.bind();
  t.object_points.clear_colours();
  t.object_points.clear_depth();
  gl_->DepthFunc(GL_ALWAYS);
  bind(0, {t.object_ids.texture(0), t.object_depth.name()});
  objects.bind(gl_);
  draw_whole(object_points_);
  gl_->Disable(GL_SCISSOR_TEST);
}

/// Only marked pixels, added up; the fourth channel is not added.
void PicturePasses::begin_sums(const GlProgram& program, const LightSums& sums, const DrawTarget& points,
                               GLuint object_maps, GLuint room_maps, int texels) const {
  bind(0, {points.texture(0), points.texture(1), object_maps, room_maps});
  const float map_texels[] = {static_cast<float>(texels), room_extent_};
  gl_->ProgramUniform2fv(program.name(), gl_->GetUniformLocation(program.name(), "map_texels"), 1, map_texels);
  sums.target.bind();
  sums.target.clear_colours();
  gl_->Enable(GL_DEPTH_TEST);
  gl_->DepthFunc(GL_LEQUAL);
  gl_->DepthMask(GL_FALSE);
  gl_->Enable(GL_BLEND);
  gl_->BlendFuncSeparate(GL_ONE, GL_ONE, GL_ONE, GL_ZERO);
}

void PicturePasses::add_batches(const GlProgram& program, const LightBatches& lights, int first, int count) const {
  for (int k = first; k < first + count; ++k) {
    lights.bind(k);
    draw_whole(program);
  }
}

void PicturePasses::light_objects(const LightBatches& lights, const MapTextures& maps, const PixelBox& box,
                                  const RenderTargets& t) const {
  scissor(box);
  begin_sums(object_light_, t.object_sky, t.object_points, maps.object_sky, maps.room_sky, maps.sky_texels);
  add_batches(object_light_, lights, lights.sky().first_batch, lights.sky().batches);
  if (lights.sun().batches > 0) {
    begin_sums(object_light_, t.object_sun, t.object_points, maps.object_sun, maps.room_sun, maps.sun_texels);
    add_batches(object_light_, lights, lights.sun().first_batch, lights.sun().batches);
  }
  gl_->Disable(GL_BLEND);
  gl_->Disable(GL_SCISSOR_TEST);
}

void PicturePasses::light_room(const RoomBuffers& room, const LightBatches& lights, const MapTextures& maps, bool share,
                               const RenderTargets& t) const {
  t.room_points.bind();
  t.room_points.clear_depth();
  gl_->Enable(GL_DEPTH_TEST);
  gl_->DepthFunc(GL_ALWAYS);
  bind(0, {t.room_ids.texture(0)});
  room.bind(gl_);
  by_tiles(room_points_, t, [&](int) { draw_whole(room_points_); });

  begin_sums(room_light_, t.room_sky, t.room_points, maps.object_sky, maps.room_sky, maps.sky_texels);
  const LightGroup& sky = lights.sky();
  const int per_set = sky.batches / LightBatches::kSets;
  by_tiles(room_light_, t, [&](int k) {
    add_batches(room_light_, lights, sky.first_batch + (share ? k * per_set : 0), share ? per_set : sky.batches);
  });
  if (lights.sun().batches > 0) {
    begin_sums(room_light_, t.room_sun, t.room_points, maps.object_sun, maps.room_sun, maps.sun_texels);
    add_batches(room_light_, lights, lights.sun().first_batch, lights.sun().batches);
  }
  gl_->Disable(GL_BLEND);
}

void PicturePasses::draw_objects(const ObjectBuffers& objects, const PixelBox& box, const RenderTargets& t) const {
  t.object_picture.bind();
  t.object_picture.clear_colours();
  if (box.empty())
    return;
  scissor(box);
  gl_->DepthMask(GL_FALSE);
  gl_->DepthFunc(GL_LEQUAL);
  bind(0, {t.object_ids.texture(0), t.object_points.texture(0), t.object_points.texture(1), objects.light_list()});
  objects.bind(gl_);
  bind(6, {t.object_sky.unblocked(), t.object_sky.lost(), t.object_sky.past_room(), t.object_sun.lost(),
           t.object_sun.past_room()});
  draw_whole(object_picture_);
  draw_whole(object_edges_); // over it
  gl_->Disable(GL_SCISSOR_TEST);
}

void PicturePasses::draw_room(bool share, const RenderTargets& t) const {
  t.room_picture.bind();
  t.room_picture.clear_colours();
  gl_->DepthMask(GL_FALSE);
  gl_->DepthFunc(GL_LEQUAL);
  bind(1,
       {t.room_sky.unblocked(), t.room_sky.lost(), t.room_sky.past_room(), t.room_sun.lost(), t.room_sun.past_room()});
  gl_->ProgramUniform3i(room_picture_.name(), gl_->GetUniformLocation(room_picture_.name(), "shared_lights"),
                        share ? 1 : 0, t.width_px - 1, t.height_px - 1);
  by_tiles(room_picture_, t, [&](int) { draw_whole(room_picture_); });
}

} // namespace daylit
