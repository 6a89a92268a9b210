#include "runtime/live/depth_tape.h"

#include <string>
#include <utility>

namespace daylit {

Result<DepthPicture> depth_of(const CameraFrame& frame, double unit_m) {
  const std::string name = "depth frame " + std::to_string(frame.id);
  if (frame.format.mosaic != Mosaic::mono || frame.format.bits <= 8 ||
      frame.bytes.size() != frame_bytes(frame.width_px, frame.height_px, frame.format))
    return Error{ErrorCode::value_invalid, "not a grey picture of more than 8 bits", name,
                 "record the depth camera in a format such as Mono16"};
  DepthPicture depth{frame.width_px, frame.height_px, {}};
  depth.z_m.reserve(frame.bytes.size() / 2);
  for (std::size_t i = 0; i + 1 < frame.bytes.size(); i += 2)
    depth.z_m.push_back(static_cast<float>(unit_m * (frame.bytes[i] | frame.bytes[i + 1] << 8)));
  return depth;
}

Result<DepthTape> DepthTape::open(const std::filesystem::path& folder, double unit_m) {
  if (!std::filesystem::exists(folder))
    return DepthTape(std::nullopt, unit_m);
  auto recording = Recording::open(folder);
  if (!recording)
    return recording.error();
  return DepthTape(std::move(*recording), unit_m);
}

Result<std::shared_ptr<const DepthPicture>> DepthTape::at(std::int64_t time_ns) {
  std::size_t after = next_;
  while (recording_ && after < recording_->size() && recording_->time_ns(after) <= time_ns)
    ++after;
  if (after == next_)
    return newest_;
  next_ = after;
  const auto frame = recording_->read(after - 1);
  if (!frame)
    return frame.error();
  auto depth = depth_of(*frame, unit_m_);
  if (!depth)
    return depth.error();
  newest_ = std::make_shared<const DepthPicture>(std::move(*depth));
  return newest_;
}

} // namespace daylit
