#include "runtime/gl/renderer.h"

#include <algorithm>
#include <tuple>

#include <glm/geometric.hpp>

#include "runtime/gl/object_grid.h"
#include "runtime/gl/picture_passes.h"
#include "runtime/gl/room_grid.h"
#include "runtime/object/bounds.h"

namespace daylit {

namespace {

constexpr float kGrounded = 1e-4f;       // of the objects' radius: what they stand on hides nothing of them
constexpr double kLeastRadius_px = 32.0; // of the objects in the picture, for neighbours to share lights

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
  bool maps_hold = false, lights_hold = false, room_holds = false, shown_holds = false;
  bool numbers_by_processor = false; ///< of the objects' triangles
  TriangleRaster raster;
  RoomView view;
  RoomGrid grid;
  ObjectGrid object_grid;
  ObjectPoints object_points;
  LightAnswers object_shares;
  ObjectPixels object_pixels;
  LightAnswers sky_answers, sun_answers;

  Result<void> start(const Room& room_model, std::span<const Aperture> apertures);
  Result<void> draw_surfaces();
  Result<void> show_surfaces();
  PixelBox object_box() const;
  void show_objects_by_processor();
  MapTextures sky_maps() const { return {object_sky.texture(), room_sky.texture(), settings.sky_map_texels}; }
  MapTextures sun_maps() const { return {object_sun.texture(), room_sun.texture(), settings.sun_map_texels}; }
  Result<void> light_objects(const PixelBox& box);
  Result<void> draw_objects();
  Result<void> light_room(RenderedFrame& frame);

  TriangleRaster::Mesh object_mesh() const {
    return {objects.positions(), objects.triangles(), origin + objects.sphere().centre};
  }
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
  const bool by_processor = settings.raster == RenderSettings::Raster::automatic
                                ? daylit::is_software(*gl)
                                : settings.raster == RenderSettings::Raster::processor;
  numbers_by_processor = by_processor && coverage_samples(*gl, settings) == TriangleRaster::kSamples;
  auto made_passes = PicturePasses::make(gl, lights.definitions(), coverage_samples(*gl, settings), room_blocks(),
                                         numbers_by_processor);
  if (!made_passes)
    return made_passes.error();
  passes = std::move(*made_passes);
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
                                       s.room_blocks(), s.numbers_by_processor);
    if (!targets)
      return targets.error();
    s.targets = std::move(*targets);
    s.room_holds = false;
  }
  s.room_holds = s.room_holds && same_view(camera, s.camera);
  s.shown_holds = s.shown_holds && same_view(camera, s.camera);
  s.camera = camera;
  s.view.set(camera, s.origin);
  return {};
}

Result<void> Renderer::set_objects(const ObjectSurface& objects) {
  State& s = *state_;
  if (const auto current = s.take_context(); !current)
    return current;
  s.maps_hold = s.shown_holds = false;
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
  s.lights_hold = false;
  return s.lights.set_lights(lights);
}

Result<void> Renderer::State::draw_surfaces() {
  const BoundingSphere& sphere = objects.sphere();
  const ShadowCaster object = objects.caster(), occluder = room.occluder(sphere, room_extent());
  if (!maps_hold || !lights_hold)
    if (const auto uploaded = lights.upload(occluder.mesh); !uploaded)
      return uploaded;
  lights_hold = true;
  const std::tuple<ShadowMaps*, const ShadowCaster*, const std::vector<MapAxes>*> maps[] = {
      {&object_sky, &object, &lights.sky().maps},
      {&object_sun, &object, &lights.sun().maps},
      {&room_sky, &occluder, &lights.sky().room_maps},
      {&room_sun, &occluder, &lights.sun().room_maps}};
  for (const auto& [map, caster, axes] : maps)
    if (!maps_hold)
      if (const auto drawn = map->draw(passes.shadow_program(), *caster, *axes, glm::vec3(sphere.centre)); !drawn)
        return drawn;
  maps_hold = true;
  return show_surfaces();
}

PixelBox Renderer::State::object_box() const {
  if (objects.empty())
    return {};
  const PixelBox box = projected_box(camera, origin + objects.sphere().centre, objects.positions());
  return PixelBox{box.x0 - 2, box.y0 - 2, box.x1 + 2, box.y1 + 2}.clipped(camera.width_px, camera.height_px);
}

void Renderer::State::show_objects_by_processor() {
  if (shown_holds)
    return;
  raster.start(camera, object_box());
  const glm::vec3 eye(camera.eye() - origin), centre(objects.sphere().centre);
  glm::vec3 least(0.0f), most(0.0f);
  for (const glm::vec3& p : objects.positions()) {
    least = glm::min(least, p);
    most = glm::max(most, p);
  }
  std::array<glm::vec3, 8> box;
  for (std::size_t k = 0; k < box.size(); ++k)
    box[k] = centre + glm::vec3(k & 1 ? most.x : least.x, k & 2 ? most.y : least.y, k & 4 ? most.z : least.z);
  const auto hiding = room.that_may_hide(box, eye, kGrounded * static_cast<float>(objects.sphere().radius));
  raster.draw({room.corners(), hiding, origin, false});
  raster.draw(object_mesh());
  raster.find_shown(kApartShare * static_cast<float>(objects.sphere().radius));
  shown_holds = true;
}

/// Which triangles of room and objects the pixels show.
Result<void> Renderer::State::show_surfaces() {
  passes.set_frame(camera, origin, objects.sphere(), room_extent(), lights);
  const PixelBox box = object_pixels.box = object_box();
  if (!room_holds)
    passes.show_room(room, targets);
  if (!box.empty()) {
    if (numbers_by_processor) {
      show_objects_by_processor();
      passes.set_shown_objects(raster, targets);
    } else {
      passes.show_objects(room, objects, box, targets);
    }
    passes.find_object_points(objects, box, targets);
  }
  if (!room_holds)
    if (const auto read = targets.room_ids.read(0, view.ids); !read)
      return read;
  room_holds = true;
  return {};
}

/// Of the sky by few points where the objects are not small in the picture; of the sun, whose shadows are sharp, by
/// all.
Result<void> Renderer::State::light_objects(const PixelBox& box) {
  if (lights.sun().batches > 0)
    passes.ask_objects(lights, lights.sun(), sun_maps(), box, targets, targets.object_sun);
  if (!shares_lights()) {
    passes.ask_objects(lights, lights.sky(), sky_maps(), box, targets, targets.object_sky);
    return {};
  }
  object_points.box = box;
  for (auto [texels, colour] : {std::pair{&object_points.offset, 0}, {&object_points.normal, 1}})
    if (const auto read = targets.object_points.read(colour, box, *texels); !read)
      return read;
  const auto ask = [&](const LightPoints& points) {
    return passes.ask(PicturePasses::On::objects, points, lights, lights.sky(), sky_maps(), targets, sky_answers);
  };
  if (const auto asked = ask(object_grid.ask_corners(object_points, static_cast<float>(objects.sphere().radius)));
      !asked)
    return asked;
  if (const auto asked = ask(object_grid.ask_pixels(object_points, sky_answers, object_shares)); !asked)
    return asked;
  object_grid.fill(sky_answers, object_shares);
  passes.set_objects_sky(object_shares, box, targets);
  return {};
}

Result<void> Renderer::State::draw_objects() {
  const PixelBox& box = object_pixels.box;
  if (!box.empty()) {
    if (const auto lit = light_objects(box); !lit)
      return lit;
    passes.draw_objects(objects, box, targets);
  }
  if (const auto read = targets.object_picture.read(0, box, object_pixels.pixels); !read)
    return read;
  return check_gl(*gl, "drawing the picture");
}

Result<void> Renderer::State::light_room(RenderedFrame& frame) {
  const BoundingSphere& sphere = objects.sphere();
  const Rgb sun = lights.sun_normal_irradiance();
  const RoomGrid::Scene scene{view,
                              room,
                              {glm::vec3(sphere.centre), static_cast<float>(sphere.radius), lights.sky().cone,
                               lights.sun().cone, lights.windows()},
                              sun.r + sun.g + sun.b,
                              shares_lights()};
  const auto ask = [&](const LightPoints& sky_points, const LightPoints& sun_points) -> Result<void> {
    if (const auto sky =
            passes.ask(PicturePasses::On::room, sky_points, lights, lights.sky(), sky_maps(), targets, sky_answers);
        !sky)
      return sky;
    return scene.whole_sun > 0.0f
               ? passes.ask(PicturePasses::On::room, sun_points, lights, lights.sun(), sun_maps(), targets, sun_answers)
               : Result<void>{};
  };
  const LightPoints& corners = grid.ask_corners(scene);
  if (const auto asked = ask(corners, corners); !asked)
    return asked;
  grid.take_corners(scene, sky_answers, sun_answers);
  grid.choose_pixels(scene, object_pixels);
  if (const auto asked = ask(grid.sky_pixels(), grid.sun_pixels()); !asked)
    return asked;
  frame.width_px = targets.width_px;
  frame.height_px = targets.height_px;
  frame.origin = origin;
  grid.fill(scene, object_pixels, sky_answers, sun_answers, frame);
  return {};
}

Result<std::vector<std::uint8_t>> Renderer::vertices_in_view() {
  State& s = *state_;
  if (!s.numbers_by_processor || s.targets.width_px == 0)
    return std::vector<std::uint8_t>(s.objects.positions().size(), 1);
  s.show_objects_by_processor();
  return s.raster.used_vertices(s.object_mesh());
}

bool Renderer::room_point(int x, int y, RoomSurface& point) const {
  if (state_->view.ids.empty())
    return false;
  point = state_->view.surface(state_->room, x, y);
  return true;
}

Result<void> Renderer::draw(RenderedFrame& frame) {
  State& s = *state_;
  if (const auto current = s.take_context(); !current)
    return current.error();
  if (s.targets.width_px == 0)
    return Error{ErrorCode::value_invalid, "no camera is set", "renderer", "call set_camera first"};
  if (const auto drawn = s.draw_surfaces(); !drawn)
    return drawn.error();
  if (const auto drawn = s.draw_objects(); !drawn)
    return drawn.error();
  return s.light_room(frame);
}

Result<RenderedFrame> Renderer::draw() {
  RenderedFrame frame;
  if (const auto drawn = draw(frame); !drawn)
    return drawn.error();
  return frame;
}

bool Renderer::is_software() const { return daylit::is_software(*state_->gl); }
std::size_t Renderer::room_occluders() const { return static_cast<std::size_t>(state_->room.occluders()); }
std::string Renderer::description() const {
  const auto text = [&](GLenum name) {
    const auto* t = state_->gl->GetString(name);
    return std::string(t ? reinterpret_cast<const char*>(t) : "?");
  };
  return state_->context->backend() + ", " + text(GL_RENDERER) + ", OpenGL " + text(GL_VERSION);
}

} // namespace daylit
