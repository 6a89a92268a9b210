#include "capture/markers/pose_filter.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

namespace daylit {

namespace {

constexpr double kMotionGain = 0.5;     // of a new velocity against the one known
constexpr double kLongestStep_s = 0.25; // between two measurements that a velocity is made of

/// Rotation vector of a unit quaternion: axis times angle, the short way round.
glm::dvec3 rotation_vector(glm::dquat q) {
  if (q.w < 0)
    q = -q;
  const glm::dvec3 v(q.x, q.y, q.z);
  const double s = glm::length(v);
  return s > 1e-12 ? v * (2 * std::atan2(s, q.w) / s) : 2.0 * v;
}

glm::dquat quaternion(const glm::dvec3& rotation_vector) {
  const double angle = glm::length(rotation_vector);
  return angle > 1e-12 ? glm::angleAxis(angle, rotation_vector / angle) : glm::dquat(1.0, 0.0, 0.0, 0.0);
}

} // namespace

PoseFilter::PoseFilter(const LensModel& lens, const BoardLayout& board, const glm::dmat4& world_from_board,
                       const PoseFilterSettings& settings)
    : lens_(lens), board_(board), world_from_board_(world_from_board), settings_(settings) {}

TrackedPose PoseFilter::tracked(TrackingState state, const Placement& placement, double age_s) const {
  glm::dmat4 camera_from_board = glm::mat4_cast(placement.attitude);
  camera_from_board[3] = glm::dvec4(placement.position, 1.0);
  return {state, world_from_board_ * glm::inverse(camera_from_board), age_s};
}

/// Root mean square over the board's corners of how far apart two placements put them; infinite where one is not seen.
double PoseFilter::distance_px(const Placement& a, const Placement& b) const {
  double sum = 0, count = 0;
  for (const PlacedMarker& marker : board_.markers)
    for (const glm::dvec2& corner : board_corners(marker)) {
      const auto pa = lens_.project(a.position + a.attitude * glm::dvec3(corner, 0.0));
      const auto pb = lens_.project(b.position + b.attitude * glm::dvec3(corner, 0.0));
      if (!pa || !pb)
        return std::numeric_limits<double>::infinity();
      sum += glm::dot(*pa - *pb, *pa - *pb), ++count;
    }
  return std::sqrt(sum / std::max(count, 1.0));
}

/// First-order low pass with gain a = 1 - exp(-dt / T). What is left over, (1 - a) d with d the distance to the
/// measurement, is the lag; a is raised where that would exceed the largest one allowed.
PoseFilter::Placement PoseFilter::smoothed(const Placement& measured, double dt) const {
  double gain = 1 - std::exp(-dt / settings_.smoothing_s);
  const double distance = distance_px(*last_, measured);
  if ((1 - gain) * distance > settings_.largest_lag_px)
    gain = 1 - settings_.largest_lag_px / distance;
  return {last_->position + gain * (measured.position - last_->position),
          glm::slerp(last_->attitude, measured.attitude, gain)};
}

PoseFilter::Placement PoseFilter::moved_on(double dt) const {
  if (!motion_)
    return *last_;
  return {last_->position + dt * motion_->velocity, glm::normalize(quaternion(dt * motion_->spin) * last_->attitude)};
}

TrackedPose PoseFilter::without_measurement(TrackingState state, double time_s) const {
  if (!last_)
    return {};
  const double age = time_s - last_time_s_;
  if (state == TrackingState::ambiguous)
    return tracked(age <= settings_.hold_s ? state : TrackingState::lost, *last_, age);
  return age <= settings_.predict_s ? tracked(state, moved_on(age), age) : tracked(TrackingState::lost, *last_, age);
}

TrackedPose PoseFilter::update(const MarkerPose* pose, double time_s) {
  if (!pose)
    return without_measurement(TrackingState::predicted, time_s);
  if (pose->tilt_uncertain())
    return without_measurement(TrackingState::ambiguous, time_s);
  const glm::dmat4 camera_from_board = glm::inverse(pose->world_from_camera) * world_from_board_;
  const Placement measured{glm::dvec3(camera_from_board[3]), glm::quat_cast(glm::dmat3(camera_from_board))};
  const double dt = time_s - last_time_s_;
  if (!last_ || dt > settings_.hold_s || dt < 0) {
    last_ = measured;
    motion_.reset();
  } else {
    const Placement next = smoothed(measured, dt);
    if (dt > 0 && dt <= kLongestStep_s) {
      const Motion now{(next.position - last_->position) / dt,
                       rotation_vector(next.attitude * glm::conjugate(last_->attitude)) / dt};
      const double old = motion_ ? 1 - kMotionGain : 0.0;
      const Motion before = motion_.value_or(Motion{});
      motion_ = Motion{old * before.velocity + (1 - old) * now.velocity, old * before.spin + (1 - old) * now.spin};
    } else if (dt > 0) {
      motion_.reset();
    }
    last_ = next;
  }
  last_time_s_ = time_s;
  return tracked(TrackingState::measured, *last_, 0.0);
}

} // namespace daylit
