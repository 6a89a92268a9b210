#include "runtime/live/replay.h"

#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <thread>
#include <utility>

#include "capture/frames/recording.h"
#include "runtime/input/camera_pictures.h"
#include "runtime/input/camera_pose.h"
#include "runtime/input/interior_input.h"
#include "runtime/input/sky_reader.h"
#include "runtime/live/depth_tape.h"
#include "runtime/live/newest.h"
#include "runtime/output/outputs.h"
#include "scene/core/program.h"

namespace daylit {

namespace {

constexpr std::chrono::milliseconds kSlice{50};

struct RecordedSky {
  MeasuredSky measured;
  std::uint64_t version = 0, frame_id = 0; ///< version: not 0
  std::int64_t time_ns = 0;
};

/// The newest sky that was there when an interior frame arrived; the first where there was none.
class SkyTape {
public:
  SkyTape(Recording recording, SkyReader reader) : recording_(std::move(recording)), reader_(std::move(reader)) {}

  /// Null: a bracket is not whole yet.
  Result<std::shared_ptr<const RecordedSky>> at(std::int64_t time_ns) {
    std::size_t newest = read_ > 0 ? read_ - 1 : 0;
    while (newest + 1 < recording_.size() && recording_.time_ns(newest + 1) <= time_ns)
      ++newest;
    if (!reader_.is_bracket())
      read_ = std::max(read_, newest);
    for (; read_ <= newest; ++read_)
      if (const auto done = read(); !done)
        return done.error();
    return sky_;
  }

private:
  Result<void> read() {
    const auto frame = recording_.read(read_);
    if (!frame)
      return frame.error();
    auto measured = reader_.read(*frame);
    if (!measured)
      return measured.error();
    if (*measured)
      sky_ = std::make_shared<const RecordedSky>(
          RecordedSky{std::move(**measured), read_ + 1, frame->id, recording_.time_ns(read_)});
    return {};
  }

  Recording recording_;
  SkyReader reader_;
  std::size_t read_ = 0; ///< frames that need not be read any more
  std::shared_ptr<const RecordedSky> sky_;
};

/// All that a picture is drawn from.
struct ReadyFrame {
  std::uint64_t id = 0;
  std::int64_t time_ns = 0;
  Photograph photo;
  TrackedPose pose;
  std::shared_ptr<const RecordedSky> sky;    ///< null: none yet
  std::shared_ptr<const DepthPicture> depth; ///< null: none
};

/// Reads the frames in their order.
class FrameReader {
public:
  FrameReader(const RunConfig& config, Recording interior, SkyTape sky, DepthTape depth, PhotographReader reader)
      : config_(config), interior_(std::move(interior)), sky_(std::move(sky)), depth_(std::move(depth)),
        reader_(std::move(reader)) {}
  std::size_t frames() const { return interior_.size(); }

  Result<ReadyFrame> read(std::size_t k) {
    const auto frame = interior_.read(k);
    if (!frame)
      return frame.error();
    auto photo = reader_.read(*frame);
    if (!photo)
      return photo.error();
    auto sky = sky_.at(frame->time_ns);
    if (!sky)
      return sky.error();
    auto depth = depth_.at(frame->time_ns);
    if (!depth)
      return depth.error();
    if (const auto opened = open_pose(frame->width_px, frame->height_px); !opened)
      return opened.error();
    const auto pose = pose_->at(*photo, 1e-9 * static_cast<double>(frame->time_ns - interior_.time_ns(0)));
    if (!pose)
      return pose.error();
    return ReadyFrame{frame->id, frame->time_ns, std::move(*photo), *pose, std::move(*sky), std::move(*depth)};
  }

private:
  /// The first frame says how large the pictures are.
  Result<void> open_pose(int width_px, int height_px) {
    if (pose_)
      return {};
    const auto lens = interior_lens(config_.interior, width_px, height_px);
    if (!lens)
      return lens.error();
    auto pose = CameraPose::make(config_, *lens);
    if (!pose)
      return pose.error();
    pose_.emplace(std::move(*pose));
    return {};
  }

  const RunConfig& config_;
  Recording interior_;
  SkyTape sky_;
  DepthTape depth_;
  PhotographReader reader_;
  std::optional<CameraPose> pose_;
};

/// While a frame is drawn the next one is read, by one thread: OpenCV keeps some memory of each thread there ever was.
class Replayer {
public:
  Replayer(const RunConfig& config, const ReplayOptions& options, FrameReader& reader)
      : config_(config), options_(options), reader_(reader),
        thread_([this](const std::stop_token& stop) { read_ahead(stop); }) {}

  std::size_t frames() const {
    return options_.most_frames > 0 ? std::min(reader_.frames(), static_cast<std::size_t>(options_.most_frames))
                                    : reader_.frames();
  }

  /// In order, from 0.
  Result<DrawnFrame> draw(std::size_t k) {
    std::optional<Result<ReadyFrame>> next;
    while (!next)
      next = next_.take(kSlice);
    const Result<ReadyFrame>& ready = *next;
    if (!ready)
      return ready.error();
    const PhotoPixels pixels = ready->photo.pixels();
    if (const auto loaded = load(pixels.width(), pixels.height()); !loaded)
      return loaded.error();
    const RecordedSky* sky = ready->sky.get();
    const FrameToDraw input{
        ready->photo,      k + 1, ready->pose, sky ? &sky->measured.sky : nullptr, sky ? sky->version : 0,
        ready->depth.get()};
    const auto composite = drawer_->draw(input);
    if (!composite)
      return composite.error();
    if (const auto written = write_outputs(numbered(config_.output, k), ready->photo, **composite); !written)
      return written.error();
    DrawnFrame done;
    done.index = k;
    done.interior_id = ready->id;
    if (sky) {
      done.sky_id = sky->frame_id;
      done.sky_age_s = 1e-9 * static_cast<double>(ready->time_ns - sky->time_ns);
      done.sky_balance = sky->measured.balance;
    }
    done.tracking = ready->pose.state;
    done.drawn = input.can_be_drawn();
    done.total_ms = drawer_->report().total_ms;
    return done;
  }

private:
  void read_ahead(const std::stop_token& stop) {
    for (std::size_t k = 0; k < frames() && !stop.stop_requested(); ++k) {
      next_.put(reader_.read(k));
      while (!stop.stop_requested() && !next_.wait_until_taken(kSlice)) {
      }
    }
  }
  Result<void> load(int width_px, int height_px) {
    if (drawer_)
      return {};
    auto drawer = FrameDrawer::open(config_, width_px, height_px, options_.backend,
                                    [](const std::string&, double) { return !interrupted(); });
    if (!drawer)
      return drawer.error();
    drawer_.emplace(std::move(*drawer));
    return {};
  }

  const RunConfig& config_;
  const ReplayOptions& options_;
  FrameReader& reader_;
  std::optional<FrameDrawer> drawer_;
  Newest<Result<ReadyFrame>> next_;
  std::jthread thread_; ///< last: it uses all of the above
};

} // namespace

Result<void> replay_recording(const RunConfig& config, const ReplayOptions& options,
                              const std::function<void(const DrawnFrame&)>& report) {
  if (config.interior.scale_from_marker)
    return Error{ErrorCode::value_invalid, "scale = \"marker\" is for single pictures", "[interior] scale",
                 "draw one picture with it, and give the number here"};
  auto interior = Recording::open(options.folder / "interior");
  if (!interior)
    return interior.error();
  auto sky = Recording::open(options.folder / "sky");
  if (!sky)
    return sky.error();
  auto depth = DepthTape::open(options.folder / "depth", config.interior.depth_unit_m);
  if (!depth)
    return depth.error();
  auto sky_reader = SkyReader::open(config.sky);
  if (!sky_reader)
    return sky_reader.error();
  auto reader = PhotographReader::open(config.interior.response);
  if (!reader)
    return reader.error();
  FrameReader frames(config, std::move(*interior), {std::move(*sky), std::move(*sky_reader)}, std::move(*depth),
                     std::move(*reader));
  Replayer replayer(config, options, frames);
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
