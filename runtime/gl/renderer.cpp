#include "runtime/gl/renderer.h"

#include <algorithm>

#include <glm/geometric.hpp>

#include "runtime/gl/frame_passes.h"
#include "scene/core/parallel.h"

namespace daylit {

namespace {

/// As many as asked for, or as the driver can.
int coverage_samples(const GlFunctions& gl, const RenderSettings& settings) {
  GLint colour = 1, depth = 1;
  gl.GetIntegerv(GL_MAX_COLOR_TEXTURE_SAMPLES, &colour);
  gl.GetIntegerv(GL_MAX_DEPTH_TEXTURE_SAMPLES, &depth);
  return std::clamp(settings.coverage_samples, 1, static_cast<int>(std::min(colour, depth)));
}

bool same_directions(const PortalLights& a, const PortalLights& b) {
  return std::ranges::equal(a.lights(), b.lights(), {}, &PortalLight::direction, &PortalLight::direction);
}

bool changes(const glm::vec4& object, const glm::vec4& lost_sky, const glm::vec4& room) {
  return object.w > 0.0f || lost_sky.x > 0.0f || lost_sky.y > 0.0f || lost_sky.z > 0.0f || room.z > 0.0f;
}

} // namespace

struct Renderer::State {
  std::unique_ptr<GlContext> context; // declared first: destroyed last, after every handle below
  Gl gl;
  RenderSettings settings;
  glm::dvec3 origin{0.0};
  double room_radius = 1.0;
  std::vector<Aperture> apertures;
  FramePasses passes;
  RoomBuffers room;
  ObjectBuffers objects;
  LightBuffers light_lists;
  FrameLights lights;
  RenderTargets targets;
  PinholeCamera camera;
  PixelRays rays;
  bool maps_are_valid = false, room_ids_are_valid = false;
  std::vector<glm::vec4> passes_read; ///< of the picture, one after the other

  Result<void> start(const Room& room_model);
  Result<void> read(RenderedFrame& frame);
  void fill_block(int column, int row, RenderedFrame& frame) const;
  std::size_t pixels() const {
    return static_cast<std::size_t>(targets.width_px()) * static_cast<std::size_t>(targets.height_px());
  }
  /// Of the room's triangle that a pixel shows, from 1; 0: none.
  std::size_t pixel_index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(targets.width_px()) + static_cast<std::size_t>(x);
  }
  std::uint32_t room_id(std::size_t pixel) const {
    return static_cast<std::uint32_t>(passes_read[2 * pixels() + pixel].w);
  }
  /// Several contexts may share a thread: each call takes its own.
  Result<void> take_context() const {
    auto current = context->make_current();
    if (!current && gl)
      gl->lost = true;
    return current;
  }
};

Result<void> Renderer::State::start(const Room& model) {
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
  auto made_passes = FramePasses::make(gl, settings.map_texels, coverage_samples(*gl, settings), room.occluders() > 0);
  if (!made_passes)
    return made_passes.error();
  passes = std::move(*made_passes);
  gl->ClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
  if (const auto empty = objects.set(gl, {}, origin); !empty)
    return empty;
  return light_lists.set(gl, {});
}

Result<Renderer> Renderer::make(std::unique_ptr<GlContext> context, const Room& room,
                                std::span<const Aperture> apertures, const RenderSettings& settings) {
  auto state = std::make_unique<State>();
  state->context = std::move(context);
  state->settings = settings;
  state->apertures.assign(apertures.begin(), apertures.end());
  if (const auto started = state->start(room); !started)
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

Result<void> Renderer::set_camera(const PinholeCamera& camera) {
  State& s = *state_;
  if (const auto current = s.take_context(); !current)
    return current;
  if (camera.width_px != s.targets.width_px() || camera.height_px != s.targets.height_px()) {
    auto targets = RenderTargets::make(s.gl, camera.width_px, camera.height_px, coverage_samples(*s.gl, s.settings));
    if (!targets)
      return targets.error();
    s.targets = std::move(*targets);
    s.passes_read.clear();
    s.room_ids_are_valid = false;
  }
  s.room_ids_are_valid = s.room_ids_are_valid && same_view(camera, s.camera);
  s.camera = camera;
  s.rays = PixelRays(camera, s.origin);
  return {};
}

Result<void> Renderer::set_objects(const ObjectSurface& objects) {
  State& s = *state_;
  if (const auto current = s.take_context(); !current)
    return current;
  s.maps_are_valid = false;
  return s.objects.set(s.gl, objects, s.origin);
}

Result<void> Renderer::set_vertex_light(std::span<const std::uint32_t> vertices, std::span<const VertexLight> light) {
  State& s = *state_;
  if (const auto fits = check_vertex_light(vertices, light.size(), s.objects.vertices()); !fits)
    return fits;
  std::vector<VertexLight> all(s.objects.vertices());
  for (std::size_t k = 0; k < vertices.size(); ++k)
    all[vertices[k]] = light[k];
  if (const auto current = s.take_context(); !current)
    return current;
  return s.objects.set_light(s.gl, all);
}

Result<void> Renderer::set_lights(const LightSet& set) {
  State& s = *state_;
  if (const auto current = s.take_context(); !current)
    return current;
  GLint layers = 0;
  s.gl->GetIntegerv(GL_MAX_ARRAY_TEXTURE_LAYERS, &layers);
  if (set.size() > static_cast<std::size_t>(layers))
    return Error{ErrorCode::limit_exceeded, std::to_string(set.size()) + " light samples", "renderer",
                 "at most " + std::to_string(layers)};
  std::vector<DirectionalLight> all = set.sky;
  all.insert(all.end(), set.sun.begin(), set.sun.end());
  FrameLights lights{PortalLights(all, s.apertures, s.origin), set.sky.size(), bounding_cone(set.sky),
                     bounding_cone(set.sun), Rgb(0.0f)};
  for (const DirectionalLight& l : set.sun)
    lights.sun_normal_irradiance += l.irradiance;
  s.maps_are_valid = s.maps_are_valid && same_directions(lights.lights, s.lights.lights);
  s.lights = std::move(lights);
  return s.light_lists.set(s.gl, s.lights.lights);
}

Result<std::vector<std::uint32_t>> Renderer::vertices_in_view() { return every_vertex(state_->objects.vertices()); }

Result<void> Renderer::draw(RenderedFrame& frame) {
  State& s = *state_;
  if (const auto current = s.take_context(); !current)
    return current;
  if (s.targets.width_px() == 0)
    return Error{ErrorCode::value_invalid, "no camera is set", "renderer", "call set_camera first"};
  const BoundingSphere& sphere = s.objects.sphere();
  s.passes.set_frame(s.camera, s.origin, sphere, static_cast<float>(s.room_radius + glm::length(sphere.centre)),
                     s.lights);
  if (!s.maps_are_valid)
    if (const auto drawn = s.passes.draw_shadow_maps(s.room, s.objects, s.lights); !drawn)
      return drawn;
  if (!s.room_ids_are_valid)
    s.passes.draw_room_ids(s.room, s.rays.eye, s.targets);
  s.maps_are_valid = s.room_ids_are_valid = true;
  s.passes.draw_object_ids(s.room, s.objects, s.targets);
  s.passes.light_picture(s.room, s.objects, s.light_lists, s.targets);
  return s.read(frame);
}

Result<void> Renderer::State::read(RenderedFrame& frame) {
  if (const auto read = targets.read_picture(passes_read); !read)
    return read;
  frame.start(targets.width_px(), targets.height_px(), {0, 0, targets.width_px(), targets.height_px()});
  parallel_for(tbb::blocked_range<int>(0, frame.rows(), 4), [&](const tbb::blocked_range<int>& range) {
    for (int row = range.begin(); row != range.end(); ++row)
      for (int column = 0; column < frame.columns(); ++column)
        fill_block(column, row, frame);
  });
  return {};
}

void Renderer::State::fill_block(int column, int row, RenderedFrame& frame) const {
  constexpr int kSide = RenderedFrame::kBlock;
  const glm::vec4 *object = passes_read.data(), *lost_sky = object + pixels(), *room_light = lost_sky + pixels();
  const PixelBox block = PixelBox{column * kSide, row * kSide, (column + 1) * kSide, (row + 1) * kSide}.clipped(
      frame.width_px, frame.height_px);
  bool shows = false;
  for (int y = block.y0; y < block.y1; ++y)
    for (int x = block.x0; x < block.x1; ++x) {
      const std::size_t i = pixel_index(x, y);
      shows = shows || changes(object[i], lost_sky[i], room_light[i]);
    }
  if (!shows)
    return;
  frame.show(column, row);
  for (int y = block.y0; y < block.y1; ++y)
    for (int x = block.x0; x < block.x1; ++x) {
      const std::size_t i = pixel_index(x, y);
      frame.at(x, y) = {object[i], lost_sky[i], glm::vec2(room_light[i]), Rgb(room_light[i].z),
                        room.triangle(room_id(i))};
    }
}

bool Renderer::room_point(int x, int y, RoomSurface& point) const {
  const State& s = *state_;
  if (s.passes_read.empty())
    return false;
  const std::uint32_t id = s.room_id(s.pixel_index(x, y));
  point.triangle = s.room.triangle(id);
  if (point.triangle != kUnknownTriangle)
    point.position = s.origin + glm::dvec3(s.room.position(id, s.rays.eye,
                                                           s.rays.ray(static_cast<float>(x), static_cast<float>(y))));
  return true;
}

std::size_t Renderer::room_occluders() const { return state_->room.occluders(); }
std::string Renderer::description() const {
  const auto text = [&](GLenum name) {
    const auto* t = state_->gl->GetString(name);
    return std::string(t ? reinterpret_cast<const char*>(t) : "?");
  };
  return state_->context->backend() + ", " + text(GL_RENDERER) + ", OpenGL " + text(GL_VERSION);
}

} // namespace daylit
