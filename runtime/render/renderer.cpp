#include "runtime/render/renderer.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include <glm/geometric.hpp>

#include "runtime/render/light_blocks.h"
#include "runtime/render/render_targets.h"
#include "runtime/render/shaders.h"
#include "runtime/render/shadow_maps.h"

namespace daylit {

namespace {

double milliseconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

template <class T>
std::span<const std::byte> bytes_of(const std::vector<T>& v) {
  return std::as_bytes(std::span<const T>(v));
}

} // namespace

struct Renderer::State {
  std::unique_ptr<GlContext> context; // declared first: destroyed last, after every handle below
  Gl gl;
  RenderSettings settings;
  glm::dvec3 origin{0.0};
  double room_radius = 1.0;
  GlProgram depth_program, shadow_program, room_program, object_program;
  GlBuffer room_vertices, occluder_vertices, object_vertices, object_light, object_indices;
  GlVertexArray room_array, occluder_array, object_array;
  int room_vertex_count = 0, occluder_vertex_count = 0, object_index_count = 0;
  std::size_t object_vertex_count = 0;
  LightBlocks light_blocks;
  ShadowMaps object_sky, object_sun, room_sky, room_sun;
  RenderTargets targets;
  RenderCamera camera;
  BoundingSphere sphere; ///< world
  RenderTimes times;

  Result<void> start(const Room& room, std::span<const Aperture> room_apertures);
  Result<void> build_programs();
  void upload_room(const Room& room, const std::vector<std::uint32_t>& occluders);
  Result<void> draw_shadow_maps();
  void set_uniforms(const GlProgram& program);
  void draw_picture();

  BoundingSphere scene_sphere() const { return {sphere.centre - origin, std::max(sphere.radius, 1e-6)}; }
  /// Several contexts may share a thread: each call takes its own.
  Result<void> take_context() const {
    auto current = context->make_current();
    if (!current && gl)
      gl->lost = true;
    return current;
  }
  double room_extent() const { return room_radius + glm::length(sphere.centre - origin); }
};

Result<void> Renderer::State::build_programs() {
  struct Entry {
    GlProgram* program;
    const char* name;
    std::vector<const char*> vertex, fragment;
  };
  const Entry entries[] = {
      {&depth_program, "depth", {shaders::scene_vertex, shaders::depth_vertex}, {shaders::depth_fragment}},
      {&shadow_program, "shadow", {shaders::shadow_vertex}, {shaders::depth_fragment}},
      {&room_program,
       "room",
       {shaders::scene_vertex, shaders::room_vertex},
       {shaders::lighting, shaders::room_fragment}},
      {&object_program,
       "object",
       {shaders::scene_vertex, shaders::object_vertex},
       {shaders::lighting, shaders::object_fragment}}};
  for (const Entry& e : entries) {
    auto program = make_program(gl, e.name, e.vertex, e.fragment);
    if (!program)
      return program.error();
    *e.program = std::move(*program);
  }
  return {};
}

void Renderer::State::upload_room(const Room& room, const std::vector<std::uint32_t>& occluders) {
  std::vector<glm::vec3> all, occluding; // position and normal per corner
  const auto append = [&](std::vector<glm::vec3>& list, const RoomTriangle& t) {
    const glm::dvec3 n = area_normal(room, t);
    const double length = glm::length(n);
    for (int k = 0; k < 3 && length > 0.0; ++k) {
      list.emplace_back(room.corner(t, k) - origin);
      list.emplace_back(n / length);
    }
  };
  for (const RoomTriangle& t : room.triangles)
    if (!room.is_window(t))
      append(all, t);
  for (const std::uint32_t i : occluders)
    append(occluding, room.triangles[i]);
  room_vertex_count = static_cast<int>(all.size() / 2);
  occluder_vertex_count = static_cast<int>(occluding.size() / 2);
  room_vertices = make_buffer(gl, bytes_of(all), GL_STATIC_DRAW);
  occluder_vertices = make_buffer(gl, bytes_of(occluding), GL_STATIC_DRAW);
  room_array = make_vertex_array(gl, {{room_vertices.name(), {3, 3}}}, 0);
  occluder_array = make_vertex_array(gl, {{occluder_vertices.name(), {3, 3}}}, 0);
}

Result<void> Renderer::State::start(const Room& room, std::span<const Aperture> room_apertures) {
  if (const auto current = context->make_current(); !current)
    return current;
  auto loaded = load_gl([this](const char* name) { return context->resolve(name); });
  if (!loaded)
    return loaded.error();
  gl = std::make_shared<const GlFunctions>(*loaded);
  if (const auto built = build_programs(); !built)
    return built;
  origin = room.bounds().empty() ? glm::dvec3(0.0) : room.bounds().centre();
  room_radius = room.bounds().empty() ? 1.0 : 0.5 * glm::length(room.bounds().size());
  upload_room(room, occluding_triangles(room, room_apertures));
  auto blocks = LightBlocks::make(gl, room_apertures, origin);
  if (!blocks)
    return blocks.error();
  light_blocks = std::move(*blocks);
  for (auto [maps, texels] : {std::pair{&object_sky, settings.sky_map_texels},
                              {&object_sun, settings.sun_map_texels},
                              {&room_sky, settings.sky_map_texels},
                              {&room_sun, settings.sun_map_texels}}) {
    auto made = ShadowMaps::make(gl, texels);
    if (!made)
      return made.error();
    *maps = std::move(*made);
  }
  gl->ClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
  gl->FrontFace(GL_CW); // image rows run downwards: what is counter-clockwise in the scene is clockwise here
  return check_gl(*gl, "renderer");
}

Result<Renderer> Renderer::make(std::unique_ptr<GlContext> context, const Room& room,
                                std::span<const Aperture> apertures, const RenderSettings& settings) {
  auto state = std::make_unique<State>();
  state->context = std::move(context);
  state->settings = settings;
  if (const auto started = state->start(room, apertures); !started)
    return started.error();
  return Renderer(std::move(state));
}

Renderer::Renderer(std::unique_ptr<State> state) : state_(std::move(state)) {}
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;
Renderer::~Renderer() {
  if (state_ && state_->context)
    if (!state_->context->make_current() && state_->gl)
      state_->gl->lost = true; // else the handles are deleted in their own context
}

Result<void> Renderer::set_camera(const RenderCamera& camera) {
  State& s = *state_;
  if (const auto current = s.take_context(); !current)
    return current;
  if (camera.width_px != s.targets.width_px() || camera.height_px != s.targets.height_px()) {
    auto targets = RenderTargets::make(s.gl, camera.width_px, camera.height_px, s.settings.coverage_samples);
    if (!targets)
      return targets.error();
    s.targets = std::move(*targets);
  }
  s.camera = camera;
  return {};
}

Result<void> Renderer::set_objects(const ObjectSurface& objects) {
  State& s = *state_;
  if (const auto current = s.take_context(); !current)
    return current;
  std::vector<glm::vec3> vertices; // position, normal, reflectance
  vertices.reserve(3 * objects.positions.size());
  for (std::size_t i = 0; i < objects.positions.size(); ++i) {
    vertices.emplace_back(objects.positions[i] - s.origin);
    vertices.push_back(objects.normals[i]);
    vertices.push_back(objects.reflectance[i]);
  }
  s.object_vertex_count = objects.positions.size();
  s.object_index_count = static_cast<int>(3 * objects.triangles.size());
  s.sphere = objects.bounds();
  s.object_vertices = make_buffer(s.gl, bytes_of(vertices));
  s.object_indices = make_buffer(s.gl, bytes_of(objects.triangles));
  const std::vector<VertexLight> dark(objects.positions.size());
  s.object_light = make_buffer(s.gl, bytes_of(dark));
  s.object_array = make_vertex_array(
      s.gl, {{s.object_vertices.name(), {3, 3, 3}}, {s.object_light.name(), {3, 3, 3, 3}}}, s.object_indices.name());
  return check_gl(*s.gl, "uploading objects");
}

Result<void> Renderer::set_vertex_light(std::span<const VertexLight> light) {
  State& s = *state_;
  if (const auto current = s.take_context(); !current)
    return current;
  if (light.size() != s.object_vertex_count)
    return Error{ErrorCode::value_invalid,
                 "light for " + std::to_string(light.size()) + " vertices, the objects have " +
                     std::to_string(s.object_vertex_count),
                 "renderer", "set the objects first"};
  refill_buffer(s.gl, s.object_light, std::as_bytes(light));
  return check_gl(*s.gl, "uploading vertex light");
}

Result<void> Renderer::set_lights(const LightSet& lights) {
  if (const auto current = state_->take_context(); !current)
    return current;
  return state_->light_blocks.set_lights(lights);
}

Result<void> Renderer::State::draw_shadow_maps() {
  const BoundingSphere bounds = scene_sphere();
  gl->Disable(GL_MULTISAMPLE);
  struct Group {
    ShadowMaps* maps;
    const GlVertexArray* array;
    int vertices;
    bool indexed;
    int first, count;
    double extent;
  };
  const int sky_lights = light_blocks.sky_lights(), sun_lights = light_blocks.sun_lights();
  const Group groups[] = {
      {&object_sky, &object_array, object_index_count, true, 0, sky_lights, bounds.radius},
      {&object_sun, &object_array, object_index_count, true, sky_lights, sun_lights, bounds.radius},
      {&room_sky, &occluder_array, occluder_vertex_count, false, 0, sky_lights, room_extent()},
      {&room_sun, &occluder_array, occluder_vertex_count, false, sky_lights, sun_lights, room_extent()}};
  light_blocks.bind();
  for (const Group& g : groups)
    if (const auto drawn = g.maps->draw(shadow_program.name(), g.array->name(), g.vertices, g.indexed, g.first, g.count,
                                        bounds, g.extent);
        !drawn)
      return drawn;
  gl->Enable(GL_MULTISAMPLE);
  return {};
}

void Renderer::State::set_uniforms(const GlProgram& program) {
  const GLuint p = program.name();
  const auto at = [&](const char* name) { return gl->GetUniformLocation(p, name); };
  const glm::mat4 clip = camera.clip_from_scene(origin);
  const glm::vec3 eye(camera.eye() - origin), centre(scene_sphere().centre);
  gl->ProgramUniformMatrix4fv(p, at("clip_from_scene"), 1, GL_FALSE, &clip[0][0]);
  gl->ProgramUniform3fv(p, at("eye"), 1, &eye.x);
  gl->ProgramUniform3fv(p, at("sphere_centre"), 1, &centre.x);
  gl->ProgramUniform1f(p, at("sphere_radius"), static_cast<float>(scene_sphere().radius));
  gl->ProgramUniform1f(p, at("room_extent"), static_cast<float>(room_extent()));
  light_blocks.set_uniforms(p);
  gl->ProgramUniform1i(p, at("room_occludes"), occluder_vertex_count > 0 ? 1 : 0);
}

void Renderer::State::draw_picture() {
  targets.bind_and_clear();
  light_blocks.bind();
  const GLuint textures[] = {object_sky.texture(), object_sun.texture(), room_sky.texture(), room_sun.texture()};
  for (GLuint unit = 0; unit < std::size(textures); ++unit)
    gl->BindTextureUnit(unit, textures[unit]);
  gl->Enable(GL_DEPTH_TEST);

  const auto draw_room = [&] {
    gl->BindVertexArray(room_array.name());
    gl->DrawArrays(GL_TRIANGLES, 0, room_vertex_count);
  };
  const auto draw_objects = [&] {
    gl->BindVertexArray(object_array.name());
    gl->DrawElements(GL_TRIANGLES, object_index_count, GL_UNSIGNED_INT, nullptr);
  };
  // Depth first, so that each sample is shaded at most once: the light loops are the cost of the frame.
  set_uniforms(depth_program);
  gl->UseProgram(depth_program.name());
  gl->ColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  gl->DepthFunc(GL_GREATER);
  draw_room();
  if (object_index_count > 0)
    draw_objects();
  gl->ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  gl->DepthMask(GL_FALSE);
  gl->DepthFunc(GL_EQUAL);
  set_uniforms(room_program);
  gl->UseProgram(room_program.name());
  draw_room();
  if (object_index_count > 0) {
    set_uniforms(object_program);
    gl->UseProgram(object_program.name());
    draw_objects();
  }
  gl->DepthMask(GL_TRUE);
  targets.resolve();
  gl->Finish();
}

Result<std::vector<std::uint8_t>> Renderer::vertices_in_view() {
  return std::vector<std::uint8_t>(state_->object_vertex_count, 1);
}

Result<void> Renderer::draw(RenderedFrame& frame) {
  State& s = *state_;
  if (const auto current = s.take_context(); !current)
    return current.error();
  if (s.targets.width_px() == 0)
    return Error{ErrorCode::value_invalid, "no camera is set", "renderer", "call set_camera first"};
  auto start = std::chrono::steady_clock::now();
  if (const auto drawn = s.draw_shadow_maps(); !drawn)
    return drawn.error();
  s.gl->Finish();
  s.times.shadow_maps_ms = milliseconds_since(start);
  start = std::chrono::steady_clock::now();
  s.draw_picture();
  if (const auto good = check_gl(*s.gl, "drawing the picture"); !good)
    return good.error();
  s.times.picture_ms = milliseconds_since(start);
  start = std::chrono::steady_clock::now();
  frame.width_px = s.targets.width_px();
  frame.height_px = s.targets.height_px();
  frame.box = {0, 0, frame.width_px, frame.height_px};
  frame.surface.clear();
  for (auto [pixels, colour] : {std::pair{&frame.object, 0}, {&frame.lost_sky, 1}, {&frame.room, 2}}) {
    auto read = s.targets.read(colour);
    if (!read)
      return read.error();
    *pixels = std::move(*read);
  }
  s.times.read_back_ms = milliseconds_since(start);
  return {};
}

Result<RenderedFrame> Renderer::draw() {
  RenderedFrame frame;
  if (const auto drawn = draw(frame); !drawn)
    return drawn.error();
  return frame;
}

bool Renderer::is_software() const {
  const auto* name = reinterpret_cast<const char*>(state_->gl->GetString(GL_RENDERER));
  const std::string text = name ? name : "";
  return text.find("llvmpipe") != std::string::npos || text.find("softpipe") != std::string::npos ||
         text.find("SWR") != std::string::npos;
}

const RenderTimes& Renderer::times() const { return state_->times; }
std::size_t Renderer::room_occluders() const { return static_cast<std::size_t>(state_->occluder_vertex_count / 3); }
std::string Renderer::description() const {
  const auto text = [&](GLenum name) {
    const auto* t = state_->gl->GetString(name);
    return std::string(t ? reinterpret_cast<const char*>(t) : "?");
  };
  return state_->context->backend() + ", " + text(GL_RENDERER) + ", OpenGL " + text(GL_VERSION);
}

} // namespace daylit
