#include "runtime/live/live_run.h"

#include <chrono>
#include <utility>

#include "capture/frames/aravis_source.h"
#include "runtime/input/camera_pictures.h"
#include "runtime/input/camera_pose.h"
#include "runtime/input/interior_input.h"
#include "runtime/input/sky_reader.h"
#include "runtime/live/camera_stage.h"
#include "runtime/live/run_state.h"
#include "runtime/output/outputs.h"

namespace daylit {

namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

/// A photograph this old is of another moment; a sky is the last good one, however old.
constexpr double kOldestPhoto_s = 1.0, kOldestSky_s = 1e9;

/// The next photograph is wanted ready after so many per cent of the time that the last picture took to draw.
constexpr int kInTime = 80;

std::int64_t now_ns() { return Clock::now().time_since_epoch() / 1ns; }
double seconds(std::int64_t ns) { return 1e-9 * static_cast<double>(ns); }

struct ReadySky {
  SkyImage sky;
  SkyBalance balance;
  std::uint64_t frame_id = 0;
  std::int64_t taken_ns = 0;
};

struct ReadyPhoto {
  Photograph photo;
  TrackedPose pose;
  std::uint64_t frame_id = 0;
  std::int64_t taken_ns = 0;
};

} // namespace

struct LiveRun::State {
  RunConfig config;
  CameraSettings sky_camera, interior_camera;
  SkyReader sky_reader;
  PhotographReader photograph_reader;
  CameraPose pose;
  FrameDrawer drawer;
  std::optional<ReadySky> sky;            ///< the last good one
  std::uint64_t sky_id = 0, photo_id = 0; ///< count those that were drawn with
  TrackingState last_tracking = TrackingState::measured;
  bool has_drawn = false; ///< the session has seen a sky
  Clock::duration last_drawing{};

  State(const RunConfig& c, CameraSettings sky_settings, CameraSettings interior_settings, SkyReader sky_read,
        PhotographReader photograph_read, CameraPose camera_pose, FrameDrawer frame_drawer)
      : config(c), sky_camera(std::move(sky_settings)), interior_camera(std::move(interior_settings)),
        sky_reader(std::move(sky_read)), photograph_reader(std::move(photograph_read)), pose(std::move(camera_pose)),
        drawer(std::move(frame_drawer)) {}
  Result<DrawnFrame> draw(const ReadyPhoto& photo, const LiveSurroundings& around);
  void take_newer(CameraStage<ReadySky>& skies);
  bool between_frames(const LiveSurroundings& around, CameraStage<ReadySky>& skies, CameraStage<ReadyPhoto>& photos);
  Result<void> draw_until_the_end(const LiveSurroundings& around, CameraStage<ReadySky>& skies,
                                  CameraStage<ReadyPhoto>& photos);
};

namespace {

std::function<void(const CameraFrame&)> offer_to(Recorder* recorder) {
  if (!recorder)
    return {};
  return [recorder](const CameraFrame& frame) { recorder->offer(frame); };
}

} // namespace

namespace {

/// `lens`: its file, empty where the projection has none.
Result<CameraSettings> settings_of(const CameraConfig& camera, const std::filesystem::path& lens,
                                   const std::vector<int>& exposures_us = {}) {
  if (lens.empty())
    return camera_settings(camera, {}, exposures_us);
  const auto read = read_lens(lens);
  return read ? camera_settings(camera, *read, exposures_us) : Result<CameraSettings>(read.error());
}

/// Of frames of that size, that the outputs fit.
Result<CameraPose> pose_of(const RunConfig& config, int width_px, int height_px) {
  if (const auto fits = check_output_size(config.output, width_px, height_px); !fits)
    return fits.error();
  const auto lens = interior_lens(config.interior, width_px, height_px);
  return lens ? CameraPose::make(config, *lens) : Result<CameraPose>(lens.error());
}

} // namespace

/// What follows from files alone, so that a mistake is told before a camera is touched.
Result<std::unique_ptr<LiveRun>> LiveRun::load(const RunConfig& config, Backend backend, const Progress& progress) {
  if (!config.sky.camera || !config.interior.camera)
    return Error{ErrorCode::value_invalid, "a live run needs two cameras", "[sky] camera, [interior] camera",
                 "daylit-run cameras lists those that answer"};
  auto sky_reader = SkyReader::open(config.sky);
  if (!sky_reader)
    return sky_reader.error();
  const auto sky_camera = settings_of(*config.sky.camera, config.sky.lens, config.sky.exposures_us);
  if (!sky_camera)
    return sky_camera.error();
  const auto interior_camera = settings_of(*config.interior.camera, config.interior.lens);
  if (!interior_camera)
    return interior_camera.error();
  auto reader = PhotographReader::open(config.interior.response);
  if (!reader)
    return reader.error();
  const int width = *interior_camera->width_px, height = *interior_camera->height_px;
  auto pose = pose_of(config, width, height);
  if (!pose)
    return pose.error();
  auto drawer = FrameDrawer::open(config, width, height, backend, progress);
  if (!drawer)
    return drawer.error();
  return std::unique_ptr<LiveRun>(
      new LiveRun(std::make_unique<State>(config, *sky_camera, *interior_camera, std::move(*sky_reader),
                                          std::move(*reader), std::move(*pose), std::move(*drawer))));
}

LiveRun::LiveRun(std::unique_ptr<State> state) : state_(std::move(state)) {}
LiveRun::~LiveRun() = default;
const std::vector<std::string>& LiveRun::notes() const { return state_->drawer.notes(); }
std::pair<int, int> LiveRun::photo_size() const {
  return {*state_->interior_camera.width_px, *state_->interior_camera.height_px};
}

Result<DrawnFrame> LiveRun::State::draw(const ReadyPhoto& p, const LiveSurroundings& around) {
  const FrameToDraw next{p.photo, ++photo_id, p.pose, sky ? &sky->sky : nullptr, sky_id};
  const auto composite = drawer.draw(next);
  if (!composite)
    return composite.error();
  DrawnFrame done;
  done.index = around.board.last_index();
  done.interior_id = p.frame_id;
  done.sky_id = sky ? sky->frame_id : 0;
  done.sky_age_s = sky ? seconds(p.taken_ns - sky->taken_ns) : 0.0;
  done.sky_balance = sky ? sky->balance : SkyBalance{};
  done.tracking = p.pose.state;
  done.drawn = next.can_be_drawn();
  done.total_ms = done.drawn ? drawer.report().total_ms : 0.0;
  if (around.frames > 0)
    if (const auto written = write_outputs(numbered(config.output, done.index), p.photo, **composite); !written)
      return written.error();
  auto view = view_of(p.photo, **composite);
  if (!view)
    return view.error();
  around.board.publish(std::move(*view), around.board.wants_linear() ? (*composite)->picture : RgbImage{});
  return done;
}

namespace {

/// Tells everybody how it stands.
void tell(const LiveSurroundings& around, const std::string& state, double sky_age_s, const CameraReport& sky,
          const CameraReport& interior) {
  const auto recording = [](const Recorder* r) { return r ? std::optional(r->report()) : std::nullopt; };
  if (around.status.set(state, sky_age_s, around.board.viewers(), sky, interior, recording(around.sky_recorder),
                        recording(around.interior_recorder)) &&
      around.state_changed)
    around.state_changed(state);
}

} // namespace

void LiveRun::State::take_newer(CameraStage<ReadySky>& skies) {
  if (auto newer = skies.take(0ms)) {
    sky = std::move(*newer);
    ++sky_id;
  }
}

/// What is to be done between two pictures. True: another one is wanted.
bool LiveRun::State::between_frames(const LiveSurroundings& around, CameraStage<ReadySky>& skies,
                                    CameraStage<ReadyPhoto>& photos) {
  const CameraReport sky_report = skies.report(), interior_report = photos.report();
  const bool wanted = around.frames > 0 || around.board.viewers() > 0;
  photos.want(wanted);
  skies.want(wanted && interior_report.source.connected);
  take_newer(skies);
  const double sky_age_s = sky ? seconds(now_ns() - sky->taken_ns) : -1.0;
  tell(around, in_words({sky_report, interior_report, wanted, sky_age_s, sky ? &sky->balance : nullptr, last_tracking}),
       sky_age_s, sky_report, interior_report);
  if (around.between_frames)
    around.between_frames(drawer.session(), has_drawn ? &sky->sky : nullptr);
  return wanted;
}

Result<void> LiveRun::State::draw_until_the_end(const LiveSurroundings& around, CameraStage<ReadySky>& skies,
                                                CameraStage<ReadyPhoto>& photos) {
  for (int drawn = 0; around.go_on() && (around.frames == 0 || drawn < around.frames);) {
    const bool wanted = between_frames(around, skies, photos);
    const auto photo = photos.take(wanted ? 50ms : 20ms, kInTime * last_drawing / 100);
    if (!photo || !wanted || seconds(now_ns() - photo->taken_ns) > kOldestPhoto_s)
      continue;
    take_newer(skies);
    if (around.frames > 0 && !sky)
      continue;
    const auto begin = Clock::now();
    const auto done = draw(*photo, around);
    last_drawing = Clock::now() - begin;
    if (!done)
      return done.error();
    last_tracking = done->tracking;
    has_drawn |= done->drawn;
    around.status.picture(*done, drawer.report(), seconds(now_ns() - photo->taken_ns));
    if (around.drawn)
      around.drawn(*done);
    ++drawn;
  }
  return {};
}

Result<void> LiveRun::run(const LiveSurroundings& around) {
  State& s = *state_;
  const auto sky_source = open_camera(s.sky_camera, offer_to(around.sky_recorder));
  if (!sky_source)
    return sky_source.error();
  const auto interior_source = open_camera(s.interior_camera, offer_to(around.interior_recorder));
  if (!interior_source)
    return interior_source.error();
  CameraWatch sky_watch(*s.sky_camera.width_px, *s.sky_camera.height_px, !s.sky_reader.is_bracket());
  CameraWatch interior_watch(*s.interior_camera.width_px, *s.interior_camera.height_px, false);
  using SkyStage = CameraStage<ReadySky>;
  const auto ready_sky = [&](const CameraFrame& f) -> Result<std::optional<ReadySky>> {
    auto measured = s.sky_reader.read(f);
    if (!measured)
      return measured.error();
    if (!*measured)
      return std::optional<ReadySky>();
    return std::optional(ReadySky{std::move((*measured)->sky), (*measured)->balance, f.id, f.taken_ns});
  };
  SkyStage skies(**sky_source, sky_watch, kOldestSky_s, ready_sky,
                 s.sky_reader.is_bracket() ? SkyStage::Takes::all : SkyStage::Takes::newest);
  CameraStage<ReadyPhoto> photos(**interior_source, interior_watch, kOldestPhoto_s,
                                 [&](const CameraFrame& f) -> Result<std::optional<ReadyPhoto>> {
                                   auto photo = s.photograph_reader.read(f);
                                   if (!photo)
                                     return photo.error();
                                   const auto pose = s.pose.at(*photo, seconds(f.taken_ns));
                                   if (!pose)
                                     return pose.error();
                                   return std::optional(ReadyPhoto{std::move(*photo), *pose, f.id, f.taken_ns});
                                 });
  return s.draw_until_the_end(around, skies, photos);
}

} // namespace daylit
