#include "runtime/session/session.h"

#include <cstddef>
#include <filesystem>
#include <numbers>
#include <utility>

#include "runtime/session/picture_stage.h"
#include "runtime/session/stage_clock.h"
#include "scene/placing/set_down.h"
#include "scene/volume/room_model.h"
#include "scene/volume/volume.h"

namespace daylit {

namespace {

constexpr float kFar_m = 1e9f;

/// What a frame found out that its user can do something about.
struct FrameState {
  std::size_t vertices_outside = 0, vertices = 0; ///< of the light field
  std::size_t object_pixels = 0, lights = 0;
  bool camera_among_objects = false, sky_black = false;
};

/// One line each, with what to do.
std::vector<std::string> frame_warnings(const FrameState& s) {
  std::vector<std::string> warnings;
  if (s.vertices > 0 && s.vertices_outside == s.vertices)
    warnings.emplace_back(
        "the objects lie outside the room or inside furniture: they get no indirect light; move them, "
        "or check [[object]] position");
  else if (s.vertices_outside > 0)
    warnings.push_back(std::to_string(s.vertices_outside) + " of " + std::to_string(s.vertices) +
                       " object vertices lie outside the room or inside furniture: they take the indirect light of "
                       "their neighbours; move the object if that part can be seen");
  if (s.camera_among_objects)
    warnings.emplace_back(
        "the camera stands among the objects: what is nearer than 1 cm is not drawn; move one of them");
  if (s.object_pixels == 0)
    warnings.emplace_back("no pixel shows an object: check its position, the camera's pose and what stands before it");
  if (s.sky_black)
    warnings.emplace_back("the sky is black: no light to draw with; check [sky] image");
  else if (s.lights == 0)
    warnings.emplace_back(
        "no window lets light through to the objects: they get indirect light only; check [room] model");
  return warnings;
}

/// Work that is never done in a room, without a loss, a line each.
std::vector<std::string> skipped_exactly(const BasisVolume& volume, std::size_t room_occluders) {
  std::vector<std::string> skipped;
  if (room_occluders == 0)
    skipped.emplace_back("shadows of the room: nothing in it stands between the object and the windows (exact)");
  const int regions = volume.partition.size(), stored = static_cast<int>(volume.stored_region.size());
  if (!volume.compact && stored < regions)
    skipped.push_back(std::to_string(regions - stored) + " of " + std::to_string(regions) +
                      " sky regions: no window sees them (exact)");
  return skipped;
}

} // namespace

/// Stages in the order of the light. Each keeps what it made with the versions of what that was made from.
struct Session::State {
  RunConfig config;
  std::unique_ptr<LoadedRoom> room;
  Backend backend = Backend::rays;
  RenderSettings render_settings;
  LensModel lens;
  std::vector<std::string> notes, skipped;

  Versioned<VirtualObjects> objects;
  Versioned<RenderCamera> camera;
  Versioned<ShownParts> shown;

  SkyStage sky{room->volume};
  LightStage light{*room};
  PictureStage picture{*room, config.reflect_by};
  PictureVersion photo;
  Cached<Frame> frame;
  FrameReport sky_report;     ///< times since the frame before
  Version last_frame_sky = 0; ///< of the sky in the frame before

  State(const RunConfig& c, std::unique_ptr<LoadedRoom> r) : config(c), room(std::move(r)) {}
  Result<void> load_rest(int width, int height, const Progress& progress);
  Result<void> start_renderer();
  Result<void> place(std::size_t k, const ObjectConfig& placement);
  WeighedMesh weighed(std::size_t k) const { return {objects->parts[k].mesh(), objects->parts[k].weight}; }
  std::vector<std::string> standing_warnings() const;
  Result<void> set_camera(const glm::dmat4& world_from_camera, int width, int height);
  void finish_report(FrameReport report);
  PictureInputs inputs() const { return {sky, light, objects, camera, shown, lens}; }
};

Result<void> Session::State::set_camera(const glm::dmat4& world_from_camera, int width, int height) {
  auto made = make_render_camera(lens, world_from_camera, width, height);
  if (!made)
    return made.error();
  if (!same_view(*made, *camera))
    camera.set(std::move(*made));
  return {};
}

Result<void> Session::State::start_renderer() {
  if (const auto started = picture.start_renderer(backend, render_settings); !started)
    return started;
  return picture.give(camera, objects);
}

Result<void> Session::State::place(std::size_t k, const ObjectConfig& placement) {
  if (k >= config.objects.size())
    return objects.change().set_placement(k, placement); // says so
  auto placed = set_down(placement, weighed(k), room->volume.room, room->rays);
  if (!placed)
    return placed.error();
  if (const auto done = objects.change().set_placement(k, *placed); !done)
    return done;
  config.objects[k] = std::move(*placed);
  return {};
}

std::vector<std::string> Session::State::standing_warnings() const {
  std::vector<std::string> lines;
  for (std::size_t k = 0; k < config.objects.size(); ++k)
    for (std::string& line : daylit::standing_warnings(config.objects[k], weighed(k), room->volume.room, room->rays))
      lines.push_back(std::move(line));
  return lines;
}

Result<void> Session::State::load_rest(int width, int height, const Progress& progress) {
  auto read = read_lens(config.interior.lens);
  if (!read)
    return read.error();
  lens = *read;
  const std::filesystem::path folder = config.volume.has_parent_path() ? config.volume.parent_path() : ".";
  auto loaded = load_virtual_objects(config.objects, folder, progress);
  if (!loaded)
    return loaded.error();
  notes = loaded->notes;
  objects.set(std::move(*loaded));
  for (std::size_t k = 0; k < config.objects.size(); ++k)
    if (config.objects[k].on)
      if (const auto placed = place(k, config.objects[k]); !placed)
        return placed;
  for (std::string& line : standing_warnings())
    notes.push_back(std::move(line));
  if (const auto r = set_camera(*config.world_from_camera, width, height); !r)
    return r;
  if (const auto r = start_renderer(); !r)
    return r;
  skipped = skipped_exactly(room->volume, picture.renderer().room_occluders());
  return {};
}

void Session::State::finish_report(FrameReport report) {
  const ObjectsDirectLight& direct = light.direct();
  const Composite& composite = frame->composite;
  report.sky_lights = direct.lights.sky.size();
  report.sun_lights = direct.lights.sun.size();
  report.object_pixels = composite.object_pixels;
  report.shadow_pixels = composite.shadow_pixels;
  report.vertices = objects->surface.positions.size();
  report.skipped = skipped;
  const bool among_objects = glm::length(camera->eye() - direct.sphere.centre) < direct.sphere.radius + kNearPlane_m;
  report.warnings = frame_warnings({light.probes().outside, light.probes().vertices.size(), report.object_pixels,
                                    direct.lights.size(), among_objects, !sky->sun && is_black(sky->pyramid.back())});
  if (direct.lights.sun_found && direct.lights.sun.empty())
    report.skipped.emplace_back("the sun: no window lets it through to the object (exact)");
  if (direct.lights.sky.empty())
    report.skipped.emplace_back("direct light: no light from the sky reaches the object through a window (exact)");
  frame.beside().report = std::move(report);
}

Result<Session> Session::open(const RunConfig& config, int width, int height, const Progress& progress, Backend backend,
                              const RenderSettings& settings) {
  if (!config.world_from_camera)
    return Error{ErrorCode::not_found, "the camera's pose is unknown", "[pose]",
                 "give world_from_camera, or position and look_at"};
  if (!progress("volume", 0.0))
    return interrupted_error("loading");
  auto room = load_room(config);
  if (!room)
    return room.error();
  if (const auto same = check_room_model(config.room_model, (*room)->volume.provenance); !same)
    return same.error();
  auto state = std::make_unique<State>(config, std::move(*room));
  state->backend = backend;
  state->render_settings = settings;
  if (const auto loaded = state->load_rest(width, height, progress); !loaded)
    return loaded.error();
  return Session(std::move(state));
}

Session::Session(std::unique_ptr<State> state) : state_(std::move(state)) {}
Session::Session(Session&&) noexcept = default;
Session& Session::operator=(Session&&) noexcept = default;
Session::~Session() = default;

Result<void> Session::set_pose(const glm::dmat4& world_from_camera) {
  return state_->set_camera(world_from_camera, camera().photo_width_px, camera().photo_height_px);
}

Result<void> Session::set_placement(std::size_t k, const ObjectConfig& placement) {
  return state_->place(k, placement);
}

Result<void> Session::set_objects(VirtualObjects loaded, std::vector<ObjectConfig> objects) {
  State& s = *state_;
  for (std::size_t k = 0; k < objects.size(); ++k) {
    auto placed =
        set_down(objects[k], {loaded.parts[k].mesh(), loaded.parts[k].weight}, s.room->volume.room, s.room->rays);
    if (!placed)
      return placed.error();
    if (const auto done = loaded.set_placement(k, *placed); !done)
      return done;
    objects[k] = std::move(*placed);
  }
  s.objects.set(std::move(loaded));
  s.config.objects = std::move(objects);
  return {};
}

const BasisVolume& Session::volume() const { return state_->room->volume; }

const LightField& Session::light_field() const { return state_->sky.field(); }

const LightSet& Session::lights() const { return state_->light.direct().lights; }

const std::vector<ObjectConfig>& Session::placements() const { return state_->config.objects; }

std::vector<std::string> Session::standing_warnings() const { return state_->standing_warnings(); }

std::optional<std::size_t> Session::object_at(const glm::dvec3& eye, const glm::dvec3& direction) const {
  const RayScene& rays = state_->room->rays;
  RayHit room;
  const bool meets = rays.closest(rays.to_local(eye), glm::vec3(direction), 0.0f, kFar_m, room);
  return state_->objects->first_hit(eye, direction, static_cast<double>(meets ? room.distance : kFar_m));
}

void Session::set_light_samples(int samples) { state_->config.light_samples = samples; }

void Session::show(const ShownParts& parts) {
  if (*state_->shown != parts)
    state_->shown.set(parts);
}

const RenderCamera& Session::camera() const { return *state_->camera; }

BoundingSphere Session::object_bounds(std::size_t k) const { return state_->objects->bounds(k); }

Rgb Session::room_radiance(const glm::dvec2& pixel) const {
  const State& s = *state_;
  const auto point = s.room->light.at(s.camera->eye(), s.camera->direction(pixel));
  if (!point)
    return Rgb(0.0f);
  const Rgb irradiance = point->indirect_irradiance + point->open_sky_irradiance;
  return PhotoScale{s.config.interior.scale, s.config.interior.colour_matrix}.apply(point->reflectance * irradiance *
                                                                                    std::numbers::inv_pi_v<float>);
}

void Session::measure_sky(const SkyImage& sky, std::uint64_t sky_id) {
  state_->sky.update(sky, sky_id, state_->sky_report);
}

Result<const Frame*> Session::render(const FrameInput& input) {
  State& s = *state_;
  if (input.photo.width() != camera().photo_width_px || input.photo.height() != camera().photo_height_px)
    return Error{ErrorCode::value_invalid, "the picture changed its size", "interior image",
                 "restart with the new size"};
  if (input.depth)
    if (const auto fits = check_depth_size(*input.depth, input.photo.width(), input.photo.height(), "depth picture");
        !fits)
      return fits.error();
  measure_sky(input.sky, input.sky_id);
  FrameReport report = std::exchange(s.sky_report, {});
  report.reused.sky = std::exchange(s.last_frame_sky, s.sky.version()) == s.sky.version();
  const Version photo = s.photo.of(input.photo, input.photo_id, input.depth);
  s.light.update(s.sky, s.objects, s.config.light_samples, report);
  if (const auto drawn = s.picture.update(s.inputs(), report); !drawn)
    return drawn.error();
  StageClock clock(report);
  const auto composed = s.frame.try_update({s.picture.version(), photo}, [&](Frame& frame) {
    return s.picture.compose_with({input.photo, input.photo_id, input.depth, photo}, s.inputs(), s.config.interior,
                                  frame.composite, report);
  });
  if (!composed)
    return composed.error();
  clock.end("composite");
  report.reused.picture = s.frame.reused();
  s.finish_report(std::move(report));
  return &*s.frame;
}

Composite Session::take_composite() && { return std::move(state_->frame.beside().composite); }

Result<void> Session::recreate_renderer() { return state_->start_renderer(); }

const std::vector<std::string>& Session::notes() const { return state_->notes; }
std::string Session::renderer_description() const { return state_->picture.renderer().description(); }

} // namespace daylit
