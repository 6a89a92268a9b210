#include "runtime/input/camera_pose.h"

namespace daylit {

Result<CameraPose> CameraPose::make(const RunConfig& config, const LensModel& lens) {
  CameraPose pose;
  pose.given_ = config.world_from_camera;
  if (pose.given_)
    return pose;
  if (!config.marker)
    return Error{ErrorCode::not_found, "the camera's pose is unknown", "[pose]", "give [pose] or [marker]"};
  const auto board = board_of(*config.marker);
  if (!board)
    return board.error();
  pose.response_ = config.interior.response;
  pose.world_from_board_ = config.marker->world_from_board;
  pose.lens_ = lens;
  pose.tracker_.emplace(*board, config.interior.response == "linear" ? kLinearExponent : kPhotographExponent);
  pose.filter_.emplace(lens, *board, pose.world_from_board_);
  return pose;
}

Result<TrackedPose> CameraPose::at(const Photograph& photo, double time_s) {
  if (given_)
    return TrackedPose{TrackingState::measured, *given_, 0.0};
  const Rgb8Image picture = marker_search_image(photo, white_);
  const auto seen = tracker_->find(picture);
  if (!seen)
    return seen.error();
  white_ = white_around(photo, *seen);
  const auto pose = refined_marker_pose(picture, *seen, lens_, tracker_->board(), world_from_board_,
                                        marker_search_exponent(photo, response_));
  return filter_->update(pose ? &*pose : nullptr, time_s);
}

const char* name_of(TrackingState state) {
  switch (state) {
  case TrackingState::measured:
    return "measured";
  case TrackingState::ambiguous:
    return "ambiguous";
  case TrackingState::predicted:
    return "predicted";
  case TrackingState::lost:
    break;
  }
  return "lost";
}

} // namespace daylit
