#pragma once

// Frames of the two cameras as what a picture is drawn from: radiance of the sky, photograph of the room.

#include <memory>
#include <string>

#include "capture/frames/aravis_source.h"
#include "capture/frames/frame.h"
#include "runtime/input/photograph.h"
#include "scene/config/config.h"
#include "scene/core/result.h"
#include "scene/sky/sky_image.h"

namespace daylit {

/// Linear: 1 = the largest code value, per millisecond of exposure where the frame states one.
class SkyReader {
public:
  /// Error: of the lens file.
  static Result<SkyReader> open(const SkyConfig& config);
  /// Errors: the frame is damaged, or of another size than the lens file's.
  Result<SkyImage> read(const CameraFrame& frame);

private:
  SkyReader(SkyProjection projection, GroundFill ground) : projection_(std::move(projection)), ground_(ground) {}
  SkyProjection projection_;
  GroundFill ground_;
  std::shared_ptr<const SkyGeometry> geometry_; ///< of the frames so far
};

/// 8 bits are code values of [interior] response; more are linear.
class PhotographReader {
public:
  /// Error: of the response file.
  static Result<PhotographReader> open(const std::string& response);
  /// Errors: the frame is damaged; more than 8 bits, and a response that is not linear.
  Result<Photograph> read(const CameraFrame& frame) const;

private:
  PhotographReader(std::string name, const CameraResponse& response) : name_(std::move(name)), response_(response) {}
  std::string name_;
  CameraResponse response_;
};

/// What the camera is asked for: as configured, in the lens file's size where none is given.
Result<CameraSettings> camera_settings(const CameraConfig& config, const LensModel& lens);

} // namespace daylit
