#include "runtime/live/replay.h"

#include <optional>
#include <utility>

#include "capture/frames/recording.h"
#include "runtime/input/camera_pictures.h"
#include "runtime/input/camera_pose.h"
#include "runtime/input/interior_input.h"
#include "runtime/input/sky_reader.h"
#include "runtime/output/outputs.h"
#include "scene/core/program.h"

namespace daylit {

namespace {

/// The newest sky frame that had arrived when an interior frame did; the first where none had.
class RecordedSky {
public:
  RecordedSky(Recording recording, SkyReader reader) : recording_(std::move(recording)), reader_(std::move(reader)) {}

  /// Moves on to the frame for `time_ns` and reads it if it is another one.
  Result<void> advance(std::int64_t time_ns) {
    std::size_t newest = read_ > 0 ? read_ - 1 : 0;
    while (newest + 1 < recording_.size() && recording_.time_ns(newest + 1) <= time_ns)
      ++newest;
    if (!reader_.is_bracket())
      read_ = std::max(read_, newest);
    for (; read_ <= newest; ++read_)
      if (const auto done = read(); !done)
        return done;
    return {};
  }
  const SkyImage* sky() const { return measured_ ? &measured_->sky : nullptr; } ///< null: a bracket is not whole yet
  SkyBalance balance() const { return measured_ ? measured_->balance : SkyBalance{}; }
  std::uint64_t frame_id() const { return id_; }
  std::uint64_t version() const { return index_ + 1; } ///< not 0
  std::int64_t time_ns() const { return recording_.time_ns(index_); }

private:
  Result<void> read() {
    const auto frame = recording_.read(read_);
    if (!frame)
      return frame.error();
    auto measured = reader_.read(*frame);
    if (!measured)
      return measured.error();
    if (*measured) {
      measured_ = std::move(*measured);
      index_ = read_;
      id_ = frame->id;
    }
    return {};
  }

  Recording recording_;
  SkyReader reader_;
  std::size_t read_ = 0; ///< frames that need not be read any more
  std::size_t index_ = 0;
  std::uint64_t id_ = 0;
  std::optional<MeasuredSky> measured_;
};

class Replayer {
public:
  Replayer(const RunConfig& config, const ReplayOptions& options, Recording interior, RecordedSky sky,
           PhotographReader reader)
      : config_(config), options_(options), interior_(std::move(interior)), sky_(std::move(sky)),
        reader_(std::move(reader)) {}

  std::size_t frames() const {
    return options_.most_frames > 0 ? std::min(interior_.size(), static_cast<std::size_t>(options_.most_frames))
                                    : interior_.size();
  }

  Result<DrawnFrame> draw(std::size_t k) {
    const auto frame = interior_.read(k);
    if (!frame)
      return frame.error();
    const auto photo = reader_.read(*frame);
    if (!photo)
      return photo.error();
    if (const auto ready = sky_.advance(frame->time_ns); !ready)
      return ready.error();
    if (const auto loaded = load(frame->width_px, frame->height_px); !loaded)
      return loaded.error();
    const auto pose = pose_->at(*photo, 1e-9 * static_cast<double>(frame->time_ns - interior_.time_ns(0)));
    if (!pose)
      return pose.error();
    const FrameToDraw next{*photo, k + 1, *pose, sky_.sky(), sky_.version()};
    const auto composite = drawer_->draw(next);
    if (!composite)
      return composite.error();
    if (const auto written = write_outputs(numbered(config_.output, k), *photo, **composite); !written)
      return written.error();
    return DrawnFrame{k,
                      frame->id,
                      sky_.frame_id(),
                      1e-9 * static_cast<double>(frame->time_ns - sky_.time_ns()),
                      pose->state,
                      next.can_be_drawn(),
                      drawer_->report().total_ms,
                      sky_.balance()};
  }

private:
  /// The first frame says how large the pictures are.
  Result<void> load(int width_px, int height_px) {
    if (drawer_)
      return {};
    const auto lens = interior_lens(config_.interior, width_px, height_px);
    if (!lens)
      return lens.error();
    auto pose = CameraPose::make(config_, *lens);
    if (!pose)
      return pose.error();
    auto drawer = FrameDrawer::open(config_, width_px, height_px, options_.backend,
                                    [](const std::string&, double) { return !interrupted(); });
    if (!drawer)
      return drawer.error();
    pose_.emplace(std::move(*pose));
    drawer_.emplace(std::move(*drawer));
    return {};
  }

  RunConfig config_;
  ReplayOptions options_;
  Recording interior_;
  RecordedSky sky_;
  PhotographReader reader_;
  std::optional<CameraPose> pose_;
  std::optional<FrameDrawer> drawer_;
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
  auto sky_reader = SkyReader::open(config.sky);
  if (!sky_reader)
    return sky_reader.error();
  auto reader = PhotographReader::open(config.interior.response);
  if (!reader)
    return reader.error();
  Replayer replayer(config, options, std::move(*interior), {std::move(*sky), std::move(*sky_reader)},
                    std::move(*reader));
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
