#pragma once

// The depth pictures of a recording.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>

#include "capture/frames/recording.h"
#include "scene/image/depth_picture.h"

namespace daylit {

/// Of one frame of a depth camera, whose numbers count `unit_m` metres; 0 is a hole. Error value_invalid: in colour, or
/// of no more than 8 bits.
Result<DepthPicture> depth_of(const CameraFrame& frame, double unit_m);

/// The newest depth picture that was there at a moment.
class DepthTape {
public:
  /// A folder without a recording holds none. Errors: the recording is damaged.
  static Result<DepthTape> open(const std::filesystem::path& folder, double unit_m);
  /// Null: none yet. Moments come in their order.
  Result<std::shared_ptr<const DepthPicture>> at(std::int64_t time_ns);

private:
  DepthTape(std::optional<Recording> recording, double unit_m) : recording_(std::move(recording)), unit_m_(unit_m) {}
  std::optional<Recording> recording_;
  double unit_m_ = kDepthUnit_m;
  std::size_t next_ = 0; ///< frame
  std::shared_ptr<const DepthPicture> newest_;
};

} // namespace daylit
