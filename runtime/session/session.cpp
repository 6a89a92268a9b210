#include "runtime/session/session.h"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <utility>

#include "runtime/composite/camera_match.h"
#include "runtime/composite/change_picture.h"
#include "runtime/indirect/indirect_shadow.h"
#include "runtime/indirect/room_light.h"
#include "runtime/indirect/vertex_light.h"
#include "runtime/object/relight.h"
#include "runtime/object/virtual_objects.h"
#include "runtime/session/frame_warnings.h"
#include "runtime/session/picture_memory.h"
#include "runtime/session/shown_parts.h"
#include "runtime/session/stage_clock.h"
#include "runtime/sky/steady_sun.h"
#include "scene/volume/volume_combiner.h"
#include "scene/volume/volume_file.h"

namespace daylit {

namespace {

std::filesystem::path folder_of(const std::filesystem::path& file) {
  return file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
}

} // namespace

struct Session::State {
  RunConfig config;
  Backend backend = Backend::automatic;
  RenderSettings render_settings;
  BasisVolume volume;
  VirtualObjects objects;
  BoundingSphere sphere;
  LensModel lens;
  RenderCamera camera;
  int photo_width_px = 0, photo_height_px = 0;
  std::optional<LightFieldSampler> sampler;
  std::optional<RayScene> room_rays;
  std::unique_ptr<PictureRenderer> renderer;
  std::optional<RoomLight> room_light;
  std::optional<IndirectShadow> indirect_shadow; ///< empty: not drawn
  ChangePicture change_picture;
  std::optional<SkyResampler> resampler;
  std::shared_ptr<const SkyGeometry> region_geometry; ///< what region_sums was made for
  std::optional<RegionSums> region_sums;
  std::vector<std::string> notes, skipped;

  // The light of the last sky.
  PictureMemory sky_memory, photo_memory;
  SteadySun steady_sun;
  std::optional<DetectedSun> sun;
  std::vector<SkyMap> pyramid;
  std::optional<VolumeCombiner> light_field;
  FrameReport sky_report; ///< times since the last frame
  bool sky_is_new = false;
  // What follows from sky, objects and camera, each with whether it still holds.
  LightSet lights;
  std::vector<ApertureCell> cells;
  std::vector<VertexProbes> vertex_probes;
  std::size_t vertices_outside = 0; ///< of the light field
  std::vector<TwoSided> indirect;
  RenderedFrame drawn;
  Frame frame;
  bool has_samples = false, has_probes = false, has_object_light = false, has_drawn = false, has_picture = false,
       has_view = false, has_room_light = false, has_indirect_shadow_sky = false;
  ShownParts shown;

  Result<void> load(const RunConfig& from, int width, int height, const Progress& progress);
  Result<void> set_camera(const glm::dmat4& world_from_camera);
  Result<void> start_renderer();
  Result<void> move_objects();
  void find_probes();
  void measure_sky(const SkyImage& sky, StageClock& clock);
  void look_at_sky(const SkyImage& sky, std::uint64_t sky_id);
  void sample();
  Result<std::vector<VertexLight>> vertex_light(FrameReport& report);
  Result<void> draw(StageClock& clock);
  void add_indirect_feedback();
  void see_each_other();
  void tell_what_leaves_objects();
  void change_room();
  void compose_picture(const RgbImage& photo, std::uint64_t photo_id);
  void report_frame();
};

Result<void> Session::State::set_camera(const glm::dmat4& world_from_camera) {
  auto made = make_render_camera(lens, world_from_camera, photo_width_px, photo_height_px);
  if (!made)
    return made.error();
  if (same_view(*made, camera))
    return {};
  camera = std::move(*made);
  has_drawn = has_object_light = has_view = false;
  return renderer->set_camera(camera);
}

Result<void> Session::State::start_renderer() {
  auto made = choose_renderer(backend, volume.room, volume.apertures, notes, render_settings);
  if (!made)
    return made.error();
  renderer = std::move(*made);
  has_view = false; // it points to the renderer
  return move_objects();
}

/// Everything that depends on where the objects are is due again.
Result<void> Session::State::move_objects() {
  sphere = objects.surface.bounds();
  has_samples = has_probes = has_object_light = has_drawn = false;
  if (indirect_shadow) {
    std::vector<PlacedPart> parts;
    for (const VirtualObjects::Part& part : objects.parts)
      parts.push_back(
          {&part.rays, part.mesh.triangles, part.mesh.positions, part.first_vertex, part.world_from_object});
    indirect_shadow->set_objects(std::move(parts));
  }
  return renderer->set_objects(objects.surface);
}

void Session::State::find_probes() {
  vertex_probes = find_vertex_probes(*sampler, objects.surface.positions);
  vertices_outside = spread_vertex_probes(objects.surface.triangles, vertex_probes);
  has_probes = true;
}

Result<void> Session::State::load(const RunConfig& from, int width, int height, const Progress& progress) {
  config = from;
  photo_width_px = width;
  photo_height_px = height;
  if (!config.world_from_camera)
    return Error{ErrorCode::not_found, "the camera's pose is unknown", "[pose]",
                 "give world_from_camera, or position and look_at"};
  if (!progress("volume", 0.0))
    return interrupted_error("loading");
  auto read = read_volume(config.volume);
  if (!read)
    return read.error();
  volume = std::move(*read);
  light_field = VolumeCombiner::make(volume);
  auto made_sampler = LightFieldSampler::make(volume);
  if (!made_sampler)
    return made_sampler.error();
  sampler.emplace(std::move(*made_sampler));
  auto rays = RayScene::build(volume.room);
  if (!rays)
    return rays.error();
  room_rays.emplace(std::move(*rays));
  room_light.emplace(volume.room, *room_rays, *sampler);
  if (config.indirect_shadow)
    indirect_shadow.emplace(volume.room, *room_rays, volume.apertures, *room_light);
  auto read_lens_file = read_lens(config.interior.lens);
  if (!read_lens_file)
    return read_lens_file.error();
  lens = *read_lens_file;
  auto loaded = load_virtual_objects(config.objects, folder_of(config.volume), progress);
  if (!loaded)
    return loaded.error();
  objects = std::move(*loaded);
  notes = objects.notes;
  if (const auto r = start_renderer(); !r)
    return r;
  if (const auto r = set_camera(*config.world_from_camera); !r)
    return r;
  skipped = skipped_exactly(volume, renderer->room_occluders());
  return {};
}

/// Sky map, sun, region radiances and light field.
void Session::State::measure_sky(const SkyImage& sky, StageClock& clock) {
  if (!resampler || !resampler->fits(sky))
    resampler = SkyResampler::make(sky);
  const auto measured = find_sun(sky, resampler->pixel_directions());
  sun = steady_sun.update(sky, measured);
  pyramid.resize(std::max<std::size_t>(pyramid.size(), 1));
  resampler->resample(sky, measured ? &*measured : nullptr, pyramid[0]);
  halve_sky_map(pyramid);
  clock.end("sky");
  if (!region_sums || region_geometry != sky.geometry()) {
    region_sums = RegionSums::make(sky.geometry(), volume.partition, regions_that_count(volume));
    region_geometry = sky.geometry();
  }
  std::vector<Rgb> regions = region_sums->reduce(sky);
  if (sun) // the regions hold the sun as this frame measured it
    add_distant_light(volume.partition, sun->direction, sun->normal_irradiance - measured->normal_irradiance, regions);
  clock.end("regions");
  light_field->update(regions);
  clock.end("combine");
  has_samples = has_room_light = has_indirect_shadow_sky = has_object_light = has_drawn = has_picture = false;
}

void Session::State::look_at_sky(const SkyImage& sky, std::uint64_t sky_id) {
  StageClock clock(sky_report);
  const bool same = sky_memory.same_as(sky.image(), sky_id, sky.geometry().get());
  clock.end("compare");
  if (same)
    return;
  measure_sky(sky, clock);
  sky_is_new = true;
}

void Session::State::sample() {
  lights = sample_lights(pyramid[0], sun, volume.apertures, sphere, config.light_samples);
  cells = aperture_cells(volume.apertures, sphere, pyramid);
  room_light->set_frame(light_field->field(), pyramid, cells, lights, has_room_light);
  has_samples = has_room_light = true;
  has_object_light = has_drawn = false;
}

Result<std::vector<VertexLight>> Session::State::vertex_light(FrameReport& report) {
  const auto in_view = renderer->vertices_in_view();
  if (!in_view)
    return in_view.error();
  const ObjectSurface& surface = objects.surface;
  const Sh9Rgb direct = direct_coefficients(pyramid, cells, lights.sun, volume.apertures, sphere.centre);
  indirect = relight_vertices(light_field->field(), vertex_probes, objects.transfer, direct, surface.reflectance,
                              &report.ringing);
  add_indirect_feedback();
  see_each_other();
  return light_vertices(surface, objects.has_back, *in_view, indirect, pyramid, cells, report.vertices_lit);
}

/// The objects stand in a room on which they cast shadows: what they see of it changes their indirect light.
void Session::State::add_indirect_feedback() {
  if (!indirect_shadow)
    return;
  indirect_shadow->set_sky(pyramid, sun, std::exchange(has_indirect_shadow_sky, true));
  add_arriving_change(*indirect_shadow, objects, indirect);
}

void Session::State::see_each_other() {
  if (!indirect_shadow || !indirect_shadow->objects_see_each_other())
    return;
  tell_what_leaves_objects();
  indirect_shadow->exchange();
  add_exchanged_change(*indirect_shadow, objects, indirect);
}

Result<void> Session::State::draw(StageClock& clock) {
  if (const auto r = renderer->set_lights(shown.direct ? lights : without_sun(lights)); !r)
    return r.error();
  auto light = vertex_light(frame.report);
  if (!light)
    return light.error();
  hide_parts(shown, *light);
  if (const auto r = renderer->set_vertex_light(*light); !r)
    return r.error();
  clock.end("object_light");
  if (const auto r = renderer->draw(drawn); !r)
    return r.error();
  clock.end("render");
  frame.report.shadow_rays = renderer->shadow_rays();
  has_drawn = has_object_light = true;
  change_room();
  if (indirect_shadow)
    clock.end("indirect_shadow");
  return {};
}

void Session::State::tell_what_leaves_objects() {
  const ObjectSurface& surface = objects.surface;
  const std::vector<DirectionalLight> windows = window_lights(pyramid, cells, sphere.centre);
  indirect_shadow->set_light(vertex_radiance(indirect, windows, surface.normals, objects.transfer, surface.reflectance),
                             surface.positions, surface.normals, surface.reflectance);
}

/// What the objects do to the room's indirect light, in the camera's view.
void Session::State::change_room() {
  if (!indirect_shadow)
    return;
  tell_what_leaves_objects();
  if (!has_view)
    change_picture.set_view(camera, *room_rays, renderer.get(), drawn.origin);
  has_view = true;
  change_picture.update(*indirect_shadow, &drawn);
}

void Session::State::compose_picture(const RgbImage& photo, std::uint64_t photo_id) {
  ComposeSettings settings{{config.interior.scale, config.interior.colour_matrix}, ShadowMode::ratio};
  settings.differential = shown.differential;
  const auto look_up = [&](const glm::dvec3& direction, const RoomSurface* seen) -> std::optional<RoomPoint> {
    if (!seen)
      return room_light->at(camera.eye(), direction);
    return room_light->at_surface(seen->triangle, drawn.origin + glm::dvec3(seen->position), direction);
  };
  compose(photo, drawn, camera, look_up, settings, frame.composite, indirect_shadow ? &change_picture : nullptr);
  match_blur(photo, config.interior.blur_px, settings.threshold, frame.composite);
  match_noise(photo, config.interior.noise, photo_id, frame.composite);
}

void Session::State::report_frame() {
  FrameReport& report = frame.report;
  report.sky_lights = lights.sky.size();
  report.sun_lights = lights.sun.size();
  report.object_pixels = frame.composite.object_pixels;
  report.shadow_pixels = frame.composite.shadow_pixels;
  report.vertices = objects.surface.positions.size();
  report.indirect_shadow_left_out = indirect_shadow ? static_cast<double>(change_picture.left_out()) : 0.0;
  report.skipped = skipped;
  report.warnings = frame_warnings({vertices_outside, vertex_probes.size(), report.object_pixels, lights.size(),
                                    glm::length(camera.eye() - sphere.centre) < sphere.radius + kNearPlane_m,
                                    !sun && is_black(pyramid.back())});
  if (lights.sun_found && lights.sun.empty())
    report.skipped.emplace_back("the sun: no window lets it through to the object (exact)");
  if (lights.sky.empty())
    report.skipped.emplace_back("direct light: no light from the sky reaches the object through a window (exact)");
}

Result<Session> Session::open(const RunConfig& config, int width, int height, const Progress& progress, Backend backend,
                              const RenderSettings& settings) {
  auto state = std::make_unique<State>();
  state->backend = backend;
  state->render_settings = settings;
  if (const auto loaded = state->load(config, width, height, progress); !loaded)
    return loaded.error();
  return Session(std::move(state));
}

Session::Session(std::unique_ptr<State> state) : state_(std::move(state)) {}
Session::Session(Session&&) noexcept = default;
Session& Session::operator=(Session&&) noexcept = default;
Session::~Session() = default;

Result<void> Session::set_pose(const glm::dmat4& world_from_camera) { return state_->set_camera(world_from_camera); }

Result<void> Session::set_placement(std::size_t k, const ObjectConfig& placement) {
  if (const auto placed = state_->objects.set_placement(k, placement); !placed)
    return placed;
  return state_->move_objects();
}

void Session::set_light_samples(int samples) {
  state_->config.light_samples = samples;
  state_->has_samples = false;
}

void Session::show(const ShownParts& parts) {
  if (state_->shown == parts)
    return;
  state_->shown = parts;
  state_->has_drawn = state_->has_object_light = false;
}

const RenderCamera& Session::camera() const { return state_->camera; }

BoundingSphere Session::object_bounds(std::size_t k) const { return state_->objects.bounds(k); }

Rgb Session::room_radiance(const glm::dvec2& pixel) const {
  const State& s = *state_;
  const auto point = s.room_light->at(s.camera.eye(), s.camera.direction(pixel));
  return point ? PhotoScale{s.config.interior.scale, s.config.interior.colour_matrix}.apply(reflected(*point))
               : Rgb(0.0f);
}

void Session::measure_sky(const SkyImage& sky, std::uint64_t sky_id) { state_->look_at_sky(sky, sky_id); }

Result<const Frame*> Session::render(const FrameInput& input) {
  State& s = *state_;
  if (input.photo.width != s.camera.photo_width_px || input.photo.height != s.camera.photo_height_px)
    return Error{ErrorCode::value_invalid, "the picture changed its size", "interior image",
                 "restart with the new size"};
  s.look_at_sky(input.sky, input.sky_id);
  s.frame.report = std::exchange(s.sky_report, {});
  Reused& reused = s.frame.report.reused;
  StageClock clock(s.frame.report);
  reused.sky = !std::exchange(s.sky_is_new, false);
  const bool same_photo = s.photo_memory.same_as(input.photo, input.photo_id, nullptr);
  clock.end("compare");
  reused.samples = s.has_samples;
  if (!s.has_samples) {
    s.sample();
    clock.end("samples");
  }
  reused.probes = s.has_probes;
  if (!s.has_probes) {
    s.find_probes();
    clock.end("probes");
  }
  reused.object_light = s.has_object_light;
  reused.drawn = s.has_drawn;
  if (!s.has_drawn) {
    s.has_picture = false;
    if (const auto drawn = s.draw(clock); !drawn)
      return drawn.error();
  }
  reused.picture = s.has_picture && same_photo;
  if (!reused.picture) {
    s.compose_picture(input.photo, input.photo_id);
    s.has_picture = true;
    clock.end("composite");
  }
  s.report_frame();
  return &std::as_const(s.frame);
}

Result<void> Session::recreate_renderer() {
  State& s = *state_;
  s.renderer.reset();
  if (const auto started = s.start_renderer(); !started)
    return started;
  return s.renderer->set_camera(s.camera);
}

const std::vector<std::string>& Session::notes() const { return state_->notes; }
std::string Session::renderer_description() const { return state_->renderer->description(); }

} // namespace daylit
