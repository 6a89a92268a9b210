#include "runtime/cmd/replay.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>
#include <utility>

#include "capture/frames/recording.h"
#include "capture/markers/marker_tracker.h"
#include "runtime/cmd/outputs.h"
#include "runtime/input/interior_input.h"
#include "runtime/session/session.h"
#include "scene/core/program.h"

namespace daylit {

namespace {

/// The radiance of a frame: code value over the largest, per millisecond where the exposure is known.
Result<RgbImage> radiance_of(const CameraFrame& frame) {
  auto picture = linear_picture(frame);
  if (!picture || !(frame.exposure_us > 0))
    return picture;
  const float per_ms = static_cast<float>(1e3 / frame.exposure_us);
  for (Rgb& t : picture->texels)
    t *= per_ms;
  return picture;
}

/// 8 bits are code values of the camera's response; more are linear.
Result<Photograph> photograph_of(const CameraFrame& frame, const std::string& response) {
  const auto curve = CameraResponse::named(response);
  if (!curve)
    return curve.error();
  auto picture = linear_picture(frame);
  if (!picture)
    return picture.error();
  if (frame.format.bits > 8 && response != "linear")
    return Error{ErrorCode::value_invalid,
                 "frames of more than 8 bits are linear, the response \"" + response + "\" is not",
                 "[interior] response", "set it to \"linear\", or record frames of 8 bits"};
  if (frame.format.bits > 8)
    return Photograph{std::move(*picture), {}, CameraResponse::linear()};
  Photograph photo{{}, {picture->width, picture->height, {}}, *curve};
  for (const Rgb& t : picture->texels)
    for (int c = 0; c < 3; ++c)
      photo.original.bytes.push_back(static_cast<std::uint8_t>(std::lround(255 * t[c])));
  return photo;
}

/// The newest sky frame that had arrived when an interior frame did; the first where none had.
class RecordedSky {
public:
  RecordedSky(Recording recording, SkyConfig config) : recording_(std::move(recording)), config_(std::move(config)) {}

  /// Moves on to the frame for `time_ns` and reads it if it is another one.
  Result<void> advance(std::int64_t time_ns) {
    std::size_t k = index_.value_or(0);
    while (k + 1 < recording_.size() && recording_.time_ns(k + 1) <= time_ns)
      ++k;
    if (index_ == k)
      return {};
    const auto frame = recording_.read(k);
    if (!frame)
      return frame.error();
    auto radiance = radiance_of(*frame);
    if (!radiance)
      return radiance.error();
    auto sky =
        geometry_ ? SkyImage::make(std::move(*radiance), geometry_, config_.ground) : first_sky(std::move(*radiance));
    if (!sky)
      return sky.error();
    geometry_ = sky->geometry();
    sky_ = std::move(*sky);
    index_ = k;
    id_ = frame->id;
    return {};
  }
  const SkyImage& sky() const { return *sky_; }
  std::uint64_t frame_id() const { return id_; }
  std::uint64_t version() const { return *index_ + 1; } ///< not 0
  std::int64_t time_ns() const { return recording_.time_ns(*index_); }

private:
  Result<SkyImage> first_sky(RgbImage radiance) const {
    const std::string name = config_.projection == "fisheye" ? "fisheye:" + config_.lens.string() : config_.projection;
    const auto projection = parse_projection(name, config_.rotation, {1.0, 0.0, 0.0}, {0.0, 0.0, 1.0});
    if (!projection)
      return projection.error();
    return SkyImage::make(std::move(radiance), *projection, config_.ground, "recorded sky");
  }

  Recording recording_;
  SkyConfig config_;
  std::optional<std::size_t> index_;
  std::uint64_t id_ = 0;
  std::shared_ptr<const SkyGeometry> geometry_;
  std::optional<SkyImage> sky_;
};

/// Where the interior camera stands: as given, or followed by its marker.
class CameraPose {
public:
  CameraPose(const RunConfig& config, const LensModel& lens) : given_(config.world_from_camera), lens_(lens) {
    if (given_ || !config.marker)
      return;
    const MarkerConfig& m = *config.marker;
    world_from_board_ = m.world_from_board;
    const BoardLayout board = BoardLayout::single(m.dictionary, m.ids.front(), m.size_m);
    tracker_.emplace(board, config.interior.response == "linear" ? kLinearExponent : kPhotographExponent);
    filter_.emplace(lens, board, m.world_from_board);
  }
  Result<TrackedPose> at(const Photograph& photo, double time_s) {
    if (given_ || !tracker_)
      return TrackedPose{TrackingState::measured, given_.value_or(glm::dmat4(1.0)), 0.0};
    const auto seen = tracker_->find(marker_search_image(photo));
    if (!seen)
      return seen.error();
    const auto pose = marker_pose(*seen, lens_, tracker_->board(), world_from_board_);
    return filter_->update(pose ? &*pose : nullptr, time_s);
  }

private:
  std::optional<glm::dmat4> given_;
  glm::dmat4 world_from_board_{1.0};
  LensModel lens_;
  std::optional<MarkerTracker> tracker_;
  std::optional<PoseFilter> filter_;
};

OutputConfig numbered(const OutputConfig& output, std::size_t index) {
  OutputConfig out = output;
  char number[24];
  std::snprintf(number, sizeof(number), "-%05zu", index);
  for (std::filesystem::path* path : {&out.png, &out.exr, &out.mask})
    if (!path->empty())
      path->replace_filename(path->stem().string() + number + path->extension().string());
  return out;
}

/// What is drawn where the pose is not known: nothing.
Composite untouched(const Photograph& photo) {
  const PhotoPixels pixels = photo.pixels();
  Composite composite;
  composite.picture = RgbImage(pixels.width(), pixels.height());
  pixels.read(0, pixels.size(), composite.picture.texels.data());
  composite.touched.assign(pixels.size(), 0);
  composite.coverage.assign(pixels.size(), 0.0f);
  return composite;
}

Result<void> check_config(const RunConfig& config) {
  if (config.interior.scale_from_marker)
    return Error{ErrorCode::value_invalid, "scale = \"marker\" is for single pictures", "[interior] scale",
                 "draw one picture with it, and give the number here"};
  if (config.marker && !config.world_from_camera && config.marker->ids.size() != 1)
    return Error{ErrorCode::value_invalid, "one marker id is needed, its centre is the board's origin", "[marker] ids",
                 "for example ids = [23]"};
  return {};
}

class Replayer {
public:
  Replayer(const RunConfig& config, const ReplayOptions& options, Recording interior, Recording sky)
      : config_(config), options_(options), interior_(std::move(interior)), sky_(std::move(sky), config.sky) {}

  std::size_t frames() const {
    return options_.most_frames > 0 ? std::min(interior_.size(), static_cast<std::size_t>(options_.most_frames))
                                    : interior_.size();
  }

  Result<ReplayedFrame> draw(std::size_t k) {
    const auto frame = interior_.read(k);
    if (!frame)
      return frame.error();
    const auto photo = photograph_of(*frame, config_.interior.response);
    if (!photo)
      return photo.error();
    if (const auto ready = sky_.advance(frame->time_ns); !ready)
      return ready.error();
    const auto pose = locate(*photo, 1e-9 * static_cast<double>(frame->time_ns - interior_.time_ns(0)));
    if (!pose)
      return pose.error();
    ReplayedFrame done{k,
                       frame->id,
                       sky_.frame_id(),
                       1e-9 * static_cast<double>(frame->time_ns - sky_.time_ns()),
                       pose->state,
                       pose->usable(),
                       0.0};
    const OutputConfig output = numbered(config_.output, k);
    if (!done.drawn) {
      if (const auto written = write_outputs(output, *photo, untouched(*photo)); !written)
        return written.error();
      return done;
    }
    const auto drawn = render(*photo, *pose, k);
    if (!drawn)
      return drawn.error();
    done.total_ms = (*drawn)->report.total_ms;
    if (const auto written = write_outputs(output, *photo, (*drawn)->composite); !written)
      return written.error();
    return done;
  }

private:
  Result<TrackedPose> locate(const Photograph& photo, double time_s) {
    if (!pose_) {
      const auto lens = interior_lens(config_.interior, photo);
      if (!lens)
        return lens.error();
      pose_.emplace(config_, *lens);
    }
    return pose_->at(photo, time_s);
  }

  Result<const Frame*> render(const Photograph& photo, const TrackedPose& pose, std::size_t k) {
    const PhotoPixels pixels = photo.pixels();
    if (!session_) {
      RunConfig config = config_;
      config.world_from_camera = pose.world_from_camera;
      auto session = Session::open(
          config, pixels.width(), pixels.height(), [](const std::string&, double) { return !interrupted(); },
          options_.backend);
      if (!session)
        return session.error();
      session_.emplace(std::move(*session));
    }
    if (const auto posed = session_->set_pose(pose.world_from_camera); !posed)
      return posed.error();
    return session_->render({sky_.sky(), pixels, sky_.version(), k + 1});
  }

  RunConfig config_;
  ReplayOptions options_;
  Recording interior_;
  RecordedSky sky_;
  std::optional<CameraPose> pose_;
  std::optional<Session> session_;
};

} // namespace

Result<void> replay_recording(const RunConfig& config, const ReplayOptions& options,
                              const std::function<void(const ReplayedFrame&)>& report) {
  if (const auto fits = check_config(config); !fits)
    return fits;
  auto interior = Recording::open(options.folder / "interior");
  if (!interior)
    return interior.error();
  auto sky = Recording::open(options.folder / "sky");
  if (!sky)
    return sky.error();
  Replayer replayer(config, options, std::move(*interior), std::move(*sky));
  for (std::size_t k = 0; k < replayer.frames(); ++k) {
    if (interrupted())
      return interrupted_error("frame " + std::to_string(k));
    const auto frame = replayer.draw(k);
    if (!frame)
      return frame.error();
    report(*frame);
  }
  return {};
}

} // namespace daylit
