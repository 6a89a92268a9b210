#pragma once

// What the interior camera's frames are, and what both cameras are asked for.

#include <string>
#include <vector>

#include "capture/frames/aravis_source.h"
#include "capture/frames/frame.h"
#include "runtime/input/photograph.h"
#include "scene/config/config.h"
#include "scene/core/result.h"

namespace daylit {

/// Code values of [interior] response. Those of 8 bits are kept as they are, of more bits what they stand for.
class PhotographReader {
public:
  /// Error: of the response file.
  static Result<PhotographReader> open(const std::string& response);
  /// Error: the frame is damaged.
  Result<Photograph> read(const CameraFrame& frame) const;

private:
  explicit PhotographReader(const ResponseCurve& response) : response_(response) {}
  ResponseCurve response_;
};

/// What the camera is asked for: as configured, in the lens file's size where none is given. `exposures_us`: cycled.
Result<CameraSettings> camera_settings(const CameraConfig& config, const LensModel& lens,
                                       const std::vector<int>& exposures_us = {});

} // namespace daylit
