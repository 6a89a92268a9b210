#pragma once

// A camera's frames written to disk beside the live picture, which never waits for the disk.

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "capture/frames/recording.h"

namespace daylit {

struct RecorderReport {
  std::uint64_t recorded = 0, dropped = 0; ///< dropped: the disk was too slow, or full
  std::string trouble;                     ///< why recording has ended; empty: it goes on
};

class Recorder {
public:
  /// Error io: the folder cannot be made, or holds a recording already.
  static Result<std::unique_ptr<Recorder>> start(const std::filesystem::path& folder);
  explicit Recorder(RecordingWriter writer);
  ~Recorder(); ///< as finish()
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  /// Never waits: a few frames are kept for a slow moment of the disk, more are dropped and counted. After an error
  /// of the disk nothing more is written.
  void offer(const CameraFrame& frame);
  RecorderReport report() const;
  /// Writes the frames that were offered, and takes no more. What became of all of them.
  RecorderReport finish();

private:
  void work();

  RecordingWriter writer_; ///< of the worker
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<CameraFrame> waiting_;
  RecorderReport report_;
  bool over_ = false;
  std::thread worker_;
};

} // namespace daylit
