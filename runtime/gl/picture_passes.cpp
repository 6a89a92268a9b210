#include "runtime/gl/picture_passes.h"

#include <algorithm>

#include "runtime/gl/shaders.h"

namespace daylit {

namespace {

// std140 layout of shaders/frame.glsl.
struct GpuFrame {
  glm::mat4 clip_from_scene;
  glm::vec4 eye, ray_corner, ray_right, ray_down, sphere, sun_normal_irradiance;
};

/// Points that follow each other share a block of 4 x 4 texels, which software rasterisers work on at once: they look
/// into the same parts of the maps.
struct AskedPlaces {
  static constexpr std::size_t kSide = 4;
  int columns = 0, rows = 0; ///< of texels that hold points, and a few more

  /// Few columns, so that the last blocks are not many; several tiles of a rasteriser for as many threads.
  AskedPlaces(std::size_t points, int width, int height) {
    constexpr int kColumns = 256;
    columns = std::min(kColumns, width);
    if (points > static_cast<std::size_t>(columns) * static_cast<std::size_t>(height))
      columns = width;
    const std::size_t row_of_blocks = kSide * static_cast<std::size_t>(columns);
    rows = static_cast<int>(kSide * ((points + row_of_blocks - 1) / row_of_blocks));
  }
  std::size_t count() const { return static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows); }
  std::size_t of(std::size_t k) const {
    const std::size_t across = static_cast<std::size_t>(columns), block = k / (kSide * kSide), in = k % (kSide * kSide);
    const std::size_t x = block % (across / kSide) * kSide + in % kSide,
                      y = block / (across / kSide) * kSide + in / kSide;
    return y * across + x;
  }
};

} // namespace

Result<void> PicturePasses::build(const std::string& definitions) {
  using namespace shaders;
  struct Entry {
    GlProgram* program;
    const char* name;
    std::vector<const char*> vertex, fragment; ///< after the definitions
  };
  constexpr const char *kOwn = "#define OWN_SHADOW true\n", *kOther = "#define OWN_SHADOW false\n";
  constexpr const char *kPlain = "#define ROOM_SHADOWS 0\n", *kPast = "#define ROOM_SHADOWS 1\n";
  constexpr const char *kWhole = "#define MIXED 0\n", *kMixed = "#define MIXED 1\n";
  const std::vector<const char*> whole{frame, marks, windows, whole_vertex};
  const std::vector<const char*> light{frame, marks, windows, light_batch, light_vertex};
  const Entry entries[] = {
      {&shadow_, "shadow", {shadow_vertex}, {depth_fragment}},
      {&ids_, "ids", {frame, scene_vertex}, {id_fragment}},
      {&object_points_, "object points", whole, {whole_fragment, marks, object_surface, object_point_fragment}},
      {&object_light_.plain, "object light", light, {kOwn, kPlain, windows, light_batch, light_fragment}},
      {&object_light_.past_room,
       "object light past the room",
       light,
       {kOwn, kPast, windows, light_batch, light_fragment}},
      {&object_picture_, "objects", whole, {kWhole, whole_fragment, object_surface, share, object_picture_fragment}},
      {&object_edges_, "edges", whole, {kMixed, whole_fragment, object_surface, share, object_picture_fragment}},
      {&room_light_.plain, "room light", light, {kOther, kPlain, windows, light_batch, light_fragment}},
      {&room_light_.past_room,
       "room light past the room",
       light,
       {kOther, kPast, windows, light_batch, light_fragment}}};
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
                                          bool room_blocks, bool ids_by_processor) {
  PicturePasses p;
  p.gl_ = gl;
  const std::string definitions = light_definitions + "#define SAMPLES " + std::to_string(samples) +
                                  "\n#define ROOM_OCCLUDES " + (room_blocks ? "1" : "0") +
                                  "\n#define IDS_BY_PROCESSOR " + (ids_by_processor ? "1" : "0") +
                                  "\n#define APART_SHARE " + std::to_string(kApartShare) + "\n";
  if (const auto built = p.build(definitions); !built)
    return built.error();
  p.nothing_ = make_vertex_array(gl, {}, 0);
  p.frame_ = make_buffer(gl, {});
  if (!ids_by_processor)
    gl->ProgramUniform1f(p.object_points_.name(), gl->GetUniformLocation(p.object_points_.name(), "near_plane"),
                         static_cast<float>(kNearPlane_m));
  gl->ProgramUniform1i(p.object_edges_.name(), gl->GetUniformLocation(p.object_edges_.name(), "mixed_only"), 1);
  return p;
}

void PicturePasses::set_frame(const RenderCamera& camera, const glm::dvec3& origin, const BoundingSphere& sphere,
                              double room_extent, const LightBatches& lights) {
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
  f.sun_normal_irradiance = glm::vec4(lights.sun_normal_irradiance(), 0.0f);
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
  gl_->Disable(GL_SCISSOR_TEST);
}

void PicturePasses::set_shown_objects(const TriangleRaster& raster, const RenderTargets& t) const {
  const PixelBox& box = raster.box();
  gl_->TextureSubImage2D(t.object_samples.name(), 0, box.x0, box.y0, box.width(), box.height(), GL_RGBA, GL_FLOAT,
                         raster.samples().data());
  gl_->TextureSubImage2D(t.object_shown.name(), 0, box.x0, box.y0, box.width(), box.height(), GL_RED, GL_FLOAT,
                         raster.shown().data());
}

void PicturePasses::find_object_points(const ObjectBuffers& objects, const PixelBox& box,
                                       const RenderTargets& t) const {
  scissor(box);
  t.object_points.bind();
  t.object_points.clear_colours();
  t.object_points.clear_depth();
  gl_->Enable(GL_DEPTH_TEST);
  gl_->DepthFunc(GL_ALWAYS);
  if (t.ids_by_processor)
    bind(0, {t.object_shown.name()});
  else
    bind(0, {t.object_ids.texture(0), t.object_depth.name()});
  objects.bind(gl_);
  draw_whole(object_points_);
  gl_->Disable(GL_SCISSOR_TEST);
}

void PicturePasses::add_lights(const LightPrograms& programs, const LightBatches& lights, const LightGroup& group,
                               const LightSums& sums, int texels, std::initializer_list<GLuint> points_and_maps) const {
  bind(0, points_and_maps);
  sums.target.bind();
  sums.target.clear_colours();
  gl_->Enable(GL_DEPTH_TEST);
  gl_->DepthFunc(GL_LEQUAL);
  gl_->DepthMask(GL_FALSE);
  gl_->Enable(GL_BLEND);
  gl_->BlendFuncSeparate(GL_ONE, GL_ONE, GL_ONE, GL_ONE);
  const int first = group.first_batch, middle = first + group.room_batches, last = first + group.batches;
  add_batches(programs.past_room, lights, first, middle, texels);
  add_batches(programs.plain, lights, middle, last, texels);
  gl_->Disable(GL_BLEND);
}

void PicturePasses::add_batches(const GlProgram& program, const LightBatches& lights, int first, int last,
                                int texels) const {
  if (first >= last)
    return;
  const float map_texels[] = {static_cast<float>(texels), room_extent_};
  gl_->ProgramUniform2fv(program.name(), gl_->GetUniformLocation(program.name(), "map_texels"), 1, map_texels);
  for (int k = first; k < last; ++k) {
    lights.bind(k);
    draw_whole(program);
  }
}

void PicturePasses::ask_objects(const LightBatches& lights, const LightGroup& group, const MapTextures& maps,
                                const PixelBox& box, const RenderTargets& t, const LightSums& sums) const {
  scissor(box);
  add_lights(object_light_, lights, group, sums, maps.texels,
             {t.object_points.texture(0), t.object_points.texture(1), maps.objects, maps.room});
  gl_->Disable(GL_SCISSOR_TEST);
}

void PicturePasses::set_objects_sky(const LightAnswers& shares, const PixelBox& box, const RenderTargets& t) const {
  const std::vector<glm::vec4>* const sums[] = {&shares.unblocked, &shares.lost, &shares.past_room};
  for (int k = 0; k < (t.object_sky.room_blocks ? 3 : 2); ++k)
    gl_->TextureSubImage2D(t.object_sky.target.texture(k), 0, box.x0, box.y0, box.width(), box.height(), GL_RGBA,
                           GL_FLOAT, sums[k]->data());
}

Result<void> PicturePasses::ask(On on, const LightPoints& points, const LightBatches& lights, const LightGroup& group,
                                const MapTextures& maps, const RenderTargets& t, LightAnswers& answers) const {
  const AskedPlaces places(points.size(), t.asked_width, t.asked_height);
  const PixelBox box{0, 0, places.columns, places.rows};
  std::vector<glm::vec4> texels_in_place;
  for (auto [texture, values] : {std::pair{&t.asked_offsets, &points.offset}, {&t.asked_normals, &points.normal}}) {
    texels_in_place.assign(places.count(), glm::vec4(0.0f));
    for (std::size_t k = 0; k < values->size(); ++k)
      texels_in_place[places.of(k)] = (*values)[k];
    if (!box.empty())
      gl_->TextureSubImage2D(texture->name(), 0, 0, 0, box.x1, box.y1, GL_RGBA, GL_FLOAT, texels_in_place.data());
  }
  if (!box.empty()) {
    scissor(box);
    add_lights(on == On::objects ? object_light_ : room_light_, lights, group, t.asked, maps.texels,
               {t.asked_offsets.name(), t.asked_normals.name(), maps.objects, maps.room});
    gl_->Disable(GL_SCISSOR_TEST);
  }
  answers.past_room.clear();
  std::vector<glm::vec4>* const sums[] = {&answers.unblocked, &answers.lost, &answers.past_room};
  for (int c = 0; c < (t.asked.room_blocks ? 3 : 2); ++c) {
    if (const auto read = t.asked.target.read(c, box, texels_in_place); !read)
      return read;
    sums[c]->resize(points.size());
    for (std::size_t k = 0; k < points.size(); ++k)
      (*sums[c])[k] = texels_in_place[places.of(k)];
  }
  return {};
}

void PicturePasses::draw_objects(const ObjectBuffers& objects, const PixelBox& box, const RenderTargets& t) const {
  scissor(box);
  t.object_picture.bind();
  t.object_picture.clear_colours();
  gl_->DepthMask(GL_FALSE);
  gl_->DepthFunc(GL_LEQUAL);
  bind(0, {t.ids(), t.object_points.texture(0), t.object_points.texture(1), objects.light_list()});
  objects.bind(gl_);
  bind(6, {t.object_sky.unblocked(), t.object_sky.lost(), t.object_sky.past_room(), t.object_sun.lost(),
           t.object_sun.past_room()});
  draw_whole(object_picture_);
  draw_whole(object_edges_); // over it
  gl_->Disable(GL_SCISSOR_TEST);
}

} // namespace daylit
