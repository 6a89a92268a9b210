#include "runtime/service/session.h"

#include <chrono>
#include <filesystem>
#include <optional>

#include "runtime/light/relight.h"
#include "runtime/light/room_light.h"
#include "runtime/object/virtual_objects.h"
#include "runtime/render/renderer.h"
#include "scene/volume_file.h"

namespace daylit {

namespace {

class StageClock {
public:
  explicit StageClock(FrameReport& report) : report_(report), start_(now()), last_(start_) {}
  void end(const char* stage) {
    const auto t = now();
    report_.stage_ms.emplace_back(stage, milliseconds(t - last_));
    report_.total_ms = milliseconds(t - start_);
    last_ = t;
  }

private:
  using Clock = std::chrono::steady_clock;
  static Clock::time_point now() { return Clock::now(); }
  static double milliseconds(Clock::duration d) { return std::chrono::duration<double, std::milli>(d).count(); }
  FrameReport& report_;
  Clock::time_point start_, last_;
};

std::filesystem::path folder_of(const std::filesystem::path& file) {
  return file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
}

} // namespace

struct Session::State {
  RunConfig config;
  BasisVolume volume;
  VirtualObjects objects;
  BoundingSphere sphere;
  RenderCamera camera;
  std::optional<LightFieldSampler> sampler;
  std::optional<RayScene> room_rays;
  std::optional<Renderer> renderer;
  std::optional<SkyResampler> resampler;
  std::shared_ptr<const SkyGeometry> region_geometry; ///< what region_sums was made for
  std::optional<RegionSums> region_sums;
  std::vector<VertexProbes> vertex_probes;
  std::vector<std::string> notes, skipped;

  Result<void> load(const RunConfig& from, int width, int height, const Progress& progress);
  Result<void> load_camera(int width, int height);
  Result<void> start_renderer();
  void note_what_is_left_out();
  std::vector<VertexLight> vertex_light(const std::vector<TwoSided>& indirect, std::span<const ApertureCell> cells,
                                        std::span<const SkyMap> pyramid) const;
};

std::vector<VertexLight> Session::State::vertex_light(const std::vector<TwoSided>& indirect,
                                                      std::span<const ApertureCell> cells,
                                                      std::span<const SkyMap> pyramid) const {
  const ObjectSurface& surface = objects.surface;
  std::vector<glm::vec3> backwards;
  for (const glm::vec3& n : surface.normals)
    backwards.push_back(-n);
  const std::vector<Rgb> front = open_sky_irradiance(pyramid, cells, surface.positions, surface.normals);
  const std::vector<Rgb> back = open_sky_irradiance(pyramid, cells, surface.positions, backwards);
  std::vector<VertexLight> light;
  for (std::size_t i = 0; i < indirect.size(); ++i)
    light.push_back({indirect[i].front, front[i], indirect[i].back, back[i]});
  return light;
}

Result<void> Session::State::load_camera(int width, int height) {
  auto lens = read_lens(config.interior.lens);
  if (!lens)
    return lens.error();
  if (!config.world_from_camera)
    return Error{ErrorCode::not_found, "the camera's pose is unknown", "[pose]",
                 "give world_from_camera, or position and look_at"};
  auto made = make_render_camera(*lens, *config.world_from_camera, width, height);
  if (!made)
    return made.error();
  camera = std::move(*made);
  return {};
}

Result<void> Session::State::start_renderer() {
  auto context = create_gl_context();
  if (!context)
    return context.error();
  auto made = Renderer::make(std::move(*context), volume.room, volume.apertures);
  if (!made)
    return made.error();
  renderer.emplace(std::move(*made));
  if (const auto r = renderer->set_camera(camera); !r)
    return r;
  return renderer->set_objects(objects.surface);
}

void Session::State::note_what_is_left_out() {
  std::size_t dark = 0;
  for (const VertexProbes& p : vertex_probes)
    dark += p.count == 0;
  if (dark > 0)
    notes.push_back(std::to_string(dark) + " of " + std::to_string(vertex_probes.size()) +
                    " object vertices lie outside the room or inside furniture: no indirect light there");
  if (renderer->room_occluders() == 0)
    skipped.emplace_back("shadow maps of the room: nothing in it stands between the object and the windows (exact)");
  const int regions = volume.partition.size(), stored = static_cast<int>(volume.stored_region.size());
  if (stored < regions)
    skipped.push_back(std::to_string(regions - stored) + " of " + std::to_string(regions) +
                      " sky regions: no window sees them (exact)");
}

Result<void> Session::State::load(const RunConfig& from, int width, int height, const Progress& progress) {
  config = from;
  if (!progress("volume", 0.0))
    return interrupted_error("loading");
  auto read = read_volume(config.volume);
  if (!read)
    return read.error();
  volume = std::move(*read);
  auto made_sampler = LightFieldSampler::make(volume);
  if (!made_sampler)
    return made_sampler.error();
  sampler.emplace(std::move(*made_sampler));
  auto rays = RayScene::build(volume.room);
  if (!rays)
    return rays.error();
  room_rays.emplace(std::move(*rays));
  if (const auto r = load_camera(width, height); !r)
    return r;
  auto loaded = load_virtual_objects(config.objects, folder_of(config.volume), progress);
  if (!loaded)
    return loaded.error();
  objects = std::move(*loaded);
  notes = objects.notes;
  sphere = objects.surface.bounds();
  vertex_probes = find_vertex_probes(*sampler, objects.surface.positions);
  if (const auto r = start_renderer(); !r)
    return r;
  note_what_is_left_out();
  return {};
}

Result<Session> Session::open(const RunConfig& config, int width, int height, const Progress& progress) {
  auto state = std::make_unique<State>();
  if (const auto loaded = state->load(config, width, height, progress); !loaded)
    return loaded.error();
  return Session(std::move(state));
}

Session::Session(std::unique_ptr<State> state) : state_(std::move(state)) {}
Session::Session(Session&&) noexcept = default;
Session& Session::operator=(Session&&) noexcept = default;
Session::~Session() = default;

Result<Frame> Session::render(const SkyImage& sky, const RgbImage& photo) {
  State& s = *state_;
  if (photo.width != s.camera.photo_width_px || photo.height != s.camera.photo_height_px)
    return Error{ErrorCode::value_invalid, "the picture changed its size", "interior image",
                 "restart with the new size"};
  Frame frame;
  StageClock clock(frame.report);

  if (!s.resampler || !s.resampler->fits(sky))
    s.resampler = SkyResampler::make(sky);
  const auto sun = find_sun(sky, s.resampler->pixel_directions());
  SkyMap map;
  s.resampler->resample(sky, sun ? &*sun : nullptr, map);
  const std::vector<SkyMap> pyramid = sky_map_pyramid(map);
  clock.end("sky");
  if (!s.region_sums || s.region_geometry != sky.geometry()) {
    s.region_sums = RegionSums::make(sky.geometry(), s.volume.partition);
    s.region_geometry = sky.geometry();
  }
  const std::vector<Rgb> regions = s.region_sums->reduce(sky);
  clock.end("regions");
  const LightField field = combine(s.volume, regions);
  clock.end("combine");
  const LightSet lights = sample_lights(map, sun, s.volume.apertures, s.sphere, s.config.light_samples);
  const std::vector<ApertureCell> cells = aperture_cells(s.volume.apertures, s.sphere, pyramid);
  clock.end("samples");
  const Sh9Rgb direct = direct_coefficients(pyramid, cells, lights.sun, s.volume.apertures, s.sphere.centre);
  const std::vector<TwoSided> indirect =
      relight_vertices(field, s.vertex_probes, s.objects.transfer, direct, s.objects.surface.reflectance);
  const std::vector<VertexLight> vertex_light = s.vertex_light(indirect, cells, pyramid);
  clock.end("object_light");

  if (const auto r = s.renderer->set_lights(lights); !r)
    return r.error();
  if (const auto r = s.renderer->set_vertex_light(vertex_light); !r)
    return r.error();
  auto drawn = s.renderer->draw();
  if (!drawn)
    return drawn.error();
  clock.end("draw");
  frame.report.stage_ms.pop_back();
  frame.report.stage_ms.emplace_back("shadow_maps", s.renderer->times().shadow_maps_ms);
  frame.report.stage_ms.emplace_back("render", s.renderer->times().picture_ms);
  frame.report.stage_ms.emplace_back("read_back", s.renderer->times().read_back_ms);

  RoomLight room_light(s.volume.room, s.volume.apertures, *s.room_rays, *s.sampler);
  room_light.set_frame(field, pyramid, cells, lights);
  const ComposeSettings settings{{s.config.interior.scale, s.config.interior.colour_matrix}, ShadowMode::ratio};
  frame.composite = compose(
      photo, *drawn, s.camera, [&](const glm::dvec3& d) { return room_light.at(s.camera.eye(), d); }, settings);
  clock.end("composite");
  frame.report.sky_lights = lights.sky.size();
  frame.report.sun_lights = lights.sun.size();
  frame.report.object_pixels = frame.composite.object_pixels;
  frame.report.shadow_pixels = frame.composite.shadow_pixels;
  frame.report.skipped = s.skipped;
  if (lights.sun_found && lights.sun.empty())
    frame.report.skipped.emplace_back("the sun: no window lets it through to the object (exact)");
  if (lights.sky.empty())
    frame.report.skipped.emplace_back(
        "direct light: no light from the sky reaches the object through a window (exact)");
  return frame;
}

const std::vector<std::string>& Session::notes() const { return state_->notes; }
std::string Session::renderer_description() const { return state_->renderer->description(); }

} // namespace daylit
