#pragma once

// What all cameras have in common: a thread that opens one, takes its frames, and opens it again when it was gone.

#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "capture/frames/frame_source.h"

namespace daylit {

/// A kind of camera says how it is opened and how its frames are taken; the rest is here. Read from any thread.
class CameraThread {
public:
  explicit CameraThread(std::function<void(const CameraFrame&)> each) : each_(std::move(each)) {}
  virtual ~CameraThread() = default;
  CameraThread(const CameraThread&) = delete;
  CameraThread& operator=(const CameraThread&) = delete;

  Result<std::optional<CameraFrame>> next(std::chrono::milliseconds wait);
  SourceReport report() const;
  /// Until leave(): the thread of the camera.
  void work();
  /// Ends work() as soon as the camera lets it. No frame is given to anybody from here on.
  void leave();
  bool is_over() const;

protected:
  /// Opens the camera and takes its frames until it is lost. Why it ended, or could not begin.
  virtual std::string stream_until_lost() = 0;

  // Of the thread of the camera.
  bool is_to_stop() const { return stop_; }
  void say_connected();
  void say_lost(const std::string& trouble);
  /// Counts a frame, and keeps it as the newest. Nothing: it was damaged. `missing`: frames between the one before and
  /// this one.
  void take(std::optional<CameraFrame> frame, std::uint64_t missing);

private:
  std::mutex each_mutex_; ///< of each_
  std::function<void(const CameraFrame&)> each_;
  mutable std::mutex mutex_; ///< of newest_, report_ and over_; held for a move at most
  std::condition_variable changed_;
  std::optional<CameraFrame> newest_;
  SourceReport report_;
  std::atomic<bool> stop_ = false;
  bool over_ = false; ///< work() has ended
};

/// Whether the thread of a source that is gone still runs: it waits for its camera.
bool is_camera_leaving();

/// The camera's frames; its thread outlives the source where a library waits for a camera that is away.
std::unique_ptr<FrameSource> source_of(std::shared_ptr<CameraThread> camera);

} // namespace daylit
