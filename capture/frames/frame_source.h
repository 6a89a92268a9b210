#pragma once

// Where frames come from: a camera, or a recording of one.

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "capture/frames/frame.h"

namespace daylit {

/// What became of the frames, since the source was opened.
struct SourceReport {
  std::uint64_t whole = 0;      ///< arrived undamaged
  std::uint64_t superseded = 0; ///< of those, replaced by a newer one before anybody asked
  std::uint64_t damaged = 0;    ///< arrived with packets missing or of another size: never given out
  std::uint64_t missing = 0;    ///< gaps in the camera's counter
  std::uint64_t connections = 0;
  bool connected = false;
  std::string trouble; ///< why there is no connection; empty: there is one
};

/// A frame is given out once; when several have come the newest one is, the others are superseded: no queue grows.
/// next() is called from one thread, report() from any.
class FrameSource {
public:
  virtual ~FrameSource() = default;
  /// Waits up to `wait` for a frame that was not given out yet. Nothing: none came; the source goes on by itself.
  /// Error: it cannot go on (a damaged recording).
  virtual Result<std::optional<CameraFrame>> next(std::chrono::milliseconds wait) = 0;
  /// No further frame will come: the recording is over.
  virtual bool finished() const = 0;
  virtual SourceReport report() const = 0;
};

} // namespace daylit
