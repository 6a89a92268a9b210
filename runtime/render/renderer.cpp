#include "runtime/render/renderer.h"

#include <algorithm>
#include <chrono>
#include <tuple>

#include <glm/geometric.hpp>
#include <tbb/parallel_for.h>

#include "runtime/render/bounds.h"
#include "runtime/render/picture_passes.h"

namespace daylit {

namespace {

constexpr double kLeastRadius_px = 32.0; // of the objects in the picture, for neighbours to share lights

double milliseconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

/// As many as asked for, or as the driver can.
int coverage_samples(const GlFunctions& gl, const RenderSettings& settings) {
  GLint colour = 1, depth = 1;
  gl.GetIntegerv(GL_MAX_COLOR_TEXTURE_SAMPLES, &colour);
  gl.GetIntegerv(GL_MAX_DEPTH_TEXTURE_SAMPLES, &depth);
  return std::clamp(settings.coverage_samples, 1, static_cast<int>(std::min(colour, depth)));
}

} // namespace

struct Renderer::State {
  std::unique_ptr<GlContext> context; // declared first: destroyed last, after every handle below
  Gl gl;
  RenderSettings settings;
  glm::dvec3 origin{0.0};
  double room_radius = 1.0;
  PicturePasses passes;
  RoomBuffers room;
  ObjectBuffers objects;
  LightBatches lights;
  ShadowMaps object_sky, object_sun, room_sky, room_sun;
  RenderTargets targets;
  RenderCamera camera;
  LightSet drawn_lights; ///< that the maps hold
  bool maps_hold = false, room_holds = false;
  std::vector<float> room_ids; ///< per pixel, triangle as drawn
  std::vector<glm::vec4> tiles_lost, tiles_room;
  RenderTimes times;

  Result<void> start(const Room& room_model, std::span<const Aperture> apertures);
  Result<void> draw_shadow_maps();
  void draw_picture();
  Result<void> read_back(RenderedFrame& frame);
  void fill_block(const PixelBox& block, RenderedFrame& frame) const;
  RoomSurface surface_at(int x, int y) const;

  bool room_blocks() const { return room.occluders() > 0; }
  /// Several contexts may share a thread: each call takes its own.
  Result<void> take_context() const {
    auto current = context->make_current();
    if (!current && gl)
      gl->lost = true;
    return current;
  }
  /// How wide a shadow is depends on the objects, not on the picture: where they are small in it, its edges would blur.
  bool shares_lights() const {
    const double distance = glm::length(objects.sphere().centre + origin - camera.eye());
    return settings.share_lights && camera.fx * objects.sphere().radius >= kLeastRadius_px * distance;
  }
  double room_extent() const { return room_radius + glm::length(objects.sphere().centre); }
};

namespace {

bool is_software(const GlFunctions& gl) {
  const auto* name = reinterpret_cast<const char*>(gl.GetString(GL_RENDERER));
  const std::string text = name ? name : "";
  return text.find("llvmpipe") != std::string::npos || text.find("softpipe") != std::string::npos ||
         text.find("SWR") != std::string::npos;
}

bool same_lights(const std::vector<DirectionalLight>& a, const std::vector<DirectionalLight>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const DirectionalLight& p, const DirectionalLight& q) { return p.direction == q.direction; });
}

} // namespace

Result<void> Renderer::State::start(const Room& model, std::span<const Aperture> apertures) {
  if (const auto current = context->make_current(); !current)
    return current;
  auto loaded = load_gl([this](const char* name) { return context->resolve(name); });
  if (!loaded)
    return loaded.error();
  gl = std::make_shared<const GlFunctions>(*loaded);
  origin = model.bounds().empty() ? glm::dvec3(0.0) : model.bounds().centre();
  room_radius = model.bounds().empty() ? 1.0 : 0.5 * glm::length(model.bounds().size());
  auto made_room = RoomBuffers::make(gl, model, apertures, origin);
  if (!made_room)
    return made_room.error();
  room = std::move(*made_room);
  auto batches = LightBatches::make(gl, apertures, origin);
  if (!batches)
    return batches.error();
  lights = std::move(*batches);
  auto made_passes = PicturePasses::make(gl, lights.definitions(), coverage_samples(*gl, settings), room_blocks());
  if (!made_passes)
    return made_passes.error();
  passes = std::move(*made_passes);
  const bool by_processor = settings.maps == RenderSettings::Maps::automatic
                                ? daylit::is_software(*gl)
                                : settings.maps == RenderSettings::Maps::processor;
  for (auto [maps, texels] : {std::pair{&object_sky, settings.sky_map_texels},
                              {&object_sun, settings.sun_map_texels},
                              {&room_sky, settings.sky_map_texels},
                              {&room_sun, settings.sun_map_texels}}) {
    auto made = ShadowMaps::make(gl, texels, by_processor);
    if (!made)
      return made.error();
    *maps = std::move(*made);
  }
  if (const auto empty = objects.set(gl, {}, origin); !empty)
    return empty;
  gl->ClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
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
  if (camera.width_px != s.targets.width_px || camera.height_px != s.targets.height_px) {
    auto targets = RenderTargets::make(s.gl, camera.width_px, camera.height_px, coverage_samples(*s.gl, s.settings),
                                       s.room_blocks());
    if (!targets)
      return targets.error();
    s.targets = std::move(*targets);
    s.room_holds = false;
  }
  s.room_holds = s.room_holds && same_view(camera, s.camera);
  s.camera = camera;
  return {};
}

Result<void> Renderer::set_objects(const ObjectSurface& objects) {
  State& s = *state_;
  if (const auto current = s.take_context(); !current)
    return current;
  s.maps_hold = false;
  return s.objects.set(s.gl, objects, s.origin);
}

Result<void> Renderer::set_vertex_light(std::span<const VertexLight> light) {
  State& s = *state_;
  if (const auto current = s.take_context(); !current)
    return current;
  return s.objects.set_light(s.gl, light);
}

Result<void> Renderer::set_lights(const LightSet& lights) {
  State& s = *state_;
  if (const auto current = s.take_context(); !current)
    return current;
  s.maps_hold =
      s.maps_hold && same_lights(lights.sky, s.drawn_lights.sky) && same_lights(lights.sun, s.drawn_lights.sun);
  s.drawn_lights = lights;
  return s.lights.set_lights(lights);
}

Result<void> Renderer::State::draw_shadow_maps() {
  if (maps_hold)
    return {};
  const BoundingSphere& sphere = objects.sphere();
  const ShadowCaster object = objects.caster(), occluder = room.occluder(sphere, room_extent());
  for (auto [maps, caster, group] : {std::tuple{&object_sky, &object, &lights.sky()},
                                     {&object_sun, &object, &lights.sun()},
                                     {&room_sky, &occluder, &lights.sky()},
                                     {&room_sun, &occluder, &lights.sun()}})
    if (const auto drawn = maps->draw(passes.shadow_program(), *caster, group->maps, glm::vec3(sphere.centre)); !drawn)
      return drawn;
  maps_hold = true;
  return {};
}

void Renderer::State::draw_picture() {
  passes.set_frame(camera, origin, objects.sphere(), room_extent(), lights, targets);
  const MapTextures maps{object_sky.texture(), object_sun.texture(),    room_sky.texture(),
                         room_sun.texture(),   settings.sky_map_texels, settings.sun_map_texels};
  if (!room_holds)
    passes.show_room(room, targets);
  PixelBox box;
  if (!objects.empty()) {
    box = projected_box(camera, origin + objects.sphere().centre, objects.positions());
    box = PixelBox{box.x0 - 2, box.y0 - 2, box.x1 + 2, box.y1 + 2}.clipped(camera.width_px, camera.height_px);
  }
  if (!box.empty()) {
    passes.show_objects(room, objects, box, targets);
    passes.light_objects(lights, maps, box, targets);
  }
  passes.draw_objects(objects, box, targets);
  passes.light_room(room, lights, maps, shares_lights(), targets);
  passes.draw_room(shares_lights(), targets);
  gl->Finish();
}

Result<std::vector<std::uint8_t>> Renderer::vertices_in_view() {
  return std::vector<std::uint8_t>(state_->objects.positions().size(), 1);
}

Result<void> Renderer::State::read_back(RenderedFrame& frame) {
  if (!room_holds)
    if (const auto read = targets.room_ids.read(0, room_ids); !read)
      return read;
  room_holds = true;
  if (const auto read = targets.object_picture.read(0, frame.object); !read)
    return read;
  for (auto [pixels, colour] : {std::pair{&tiles_lost, 0}, {&tiles_room, 1}})
    if (const auto read = targets.room_picture.read(colour, *pixels); !read)
      return read;
  frame.width_px = targets.width_px;
  frame.height_px = targets.height_px;
  frame.box = {0, 0, frame.width_px, frame.height_px};
  frame.origin = origin;
  frame.lost_sky.resize(frame.object.size());
  frame.room.resize(frame.object.size());
  frame.surface.resize(frame.object.size());
  constexpr int kBlock = RenderedFrame::kBlock;
  const int columns = (frame.width_px + kBlock - 1) / kBlock, rows = (frame.height_px + kBlock - 1) / kBlock;
  frame.shows.resize(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
  tbb::parallel_for(0, rows, [&](int row) {
    for (int x = 0; x < frame.width_px; x += kBlock)
      fill_block(PixelBox{x, row * kBlock, x + kBlock, (row + 1) * kBlock}.common(frame.box), frame);
  });
  return {};
}

/// Puts the room's tiles back in place where something shows.
void Renderer::State::fill_block(const PixelBox& block, RenderedFrame& frame) const {
  const auto place = [&](int x, int y) { // shaders/whole_fragment.glsl
    return static_cast<std::size_t>((y & 1) * targets.tile_height + y / 2) *
               (2 * static_cast<std::size_t>(targets.tile_width)) +
           static_cast<std::size_t>((x & 1) * targets.tile_width + x / 2);
  };
  bool shows = false;
  for (int y = block.y0; y < block.y1; ++y)
    for (int x = block.x0; x < block.x1; ++x) {
      const glm::vec4 &lost = tiles_lost[place(x, y)], &shares = tiles_room[place(x, y)];
      shows = shows || frame.object[frame.index(x, y)].w > 0.0f || lost.x > 0.0f || lost.y > 0.0f || lost.z > 0.0f ||
              shares.z > 0.0f;
    }
  frame.shows[frame.block_index(block.x0, block.y0)] = shows ? 1 : 0;
  for (int y = block.y0; shows && y < block.y1; ++y)
    for (int x = block.x0; x < block.x1; ++x) {
      const std::size_t i = frame.index(x, y), k = place(x, y);
      frame.surface[i] = surface_at(x, y);
      const bool asked = tiles_lost[k].w > 0.0f, in_room = frame.surface[i].triangle != RoomSurface{}.triangle;
      const float open = 1.0f - frame.object[i].w;
      frame.lost_sky[i] = open * (asked ? tiles_lost[k] : glm::vec4(0.0f, 0.0f, 0.0f, in_room ? 1.0f : 0.0f));
      frame.room[i] = open * (asked ? tiles_room[k] : glm::vec4(in_room ? 1.0f : 0.0f, 0.0f, 0.0f, 0.0f));
    }
}

RoomSurface Renderer::State::surface_at(int x, int y) const {
  const int id = static_cast<int>(
      room_ids[static_cast<std::size_t>(y) * static_cast<std::size_t>(targets.width_px) + static_cast<std::size_t>(x)]);
  if (id <= 0)
    return {};
  const glm::vec4& plane = room.plane(id);
  const glm::dvec3 eye = camera.eye() - origin, ray = camera.direction({x, y}), n(plane);
  const double t = -(glm::dot(n, eye) + static_cast<double>(plane.w)) / glm::dot(n, ray);
  return {room.triangle(id), glm::vec3(eye + t * ray)};
}

bool Renderer::room_point(int x, int y, RoomSurface& point) const {
  if (state_->room_ids.empty())
    return false;
  point = state_->surface_at(x, y);
  return true;
}

Result<void> Renderer::draw(RenderedFrame& frame) {
  State& s = *state_;
  if (const auto current = s.take_context(); !current)
    return current.error();
  if (s.targets.width_px == 0)
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
  if (const auto read = s.read_back(frame); !read)
    return read;
  s.times.read_back_ms = milliseconds_since(start);
  return {};
}

Result<RenderedFrame> Renderer::draw() {
  RenderedFrame frame;
  if (const auto drawn = draw(frame); !drawn)
    return drawn.error();
  return frame;
}

bool Renderer::is_software() const { return daylit::is_software(*state_->gl); }
const RenderTimes& Renderer::times() const { return state_->times; }
std::size_t Renderer::room_occluders() const { return static_cast<std::size_t>(state_->room.occluders()); }
std::string Renderer::description() const {
  const auto text = [&](GLenum name) {
    const auto* t = state_->gl->GetString(name);
    return std::string(t ? reinterpret_cast<const char*>(t) : "?");
  };
  return state_->context->backend() + ", " + text(GL_RENDERER) + ", OpenGL " + text(GL_VERSION);
}

} // namespace daylit
