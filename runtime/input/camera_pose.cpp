#include "runtime/input/camera_pose.h"

namespace daylit {

Result<BoardLayout> board_of(const MarkerConfig& marker) {
  for (const int id : marker.ids)
    if (const auto print = marker_print(marker.dictionary, id); !print)
      return print.error();
  if (marker.columns > 0)
    return BoardLayout::grid(marker.dictionary, marker.ids, marker.columns, marker.size_m, marker.gap_m);
  if (marker.ids.size() != 1)
    return Error{ErrorCode::value_invalid, "several markers need their places on the board", "[marker] ids",
                 "give columns and gap_m, or one id: its centre is the board's origin then"};
  return BoardLayout::single(marker.dictionary, marker.ids.front(), marker.size_m);
}

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
  const Rgb8Image picture = marker_search_image(photo);
  const auto seen = tracker_->find(picture);
  if (!seen)
    return seen.error();
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
