#include "capture/markers/pose_filter.h"

#include <cmath>
#include <random>

#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/matrix.hpp>
#include <gtest/gtest.h>

namespace daylit {
namespace {

constexpr double kFrame_s = 0.04;

LensModel lens() { return ideal_pinhole(640, 480, 1.0); }
BoardLayout board() { return *BoardLayout::grid("6X6_250", {0, 1, 2, 3}, 2, 0.06, 0.02); }

/// The board 1 m before the camera, tilted by 30 degrees, its front towards it, moved by `shift` metres.
glm::dmat4 camera_from_board(const glm::dvec3& shift = glm::dvec3(0.0)) {
  glm::dmat4 m = glm::translate(glm::dmat4(1.0), glm::dvec3(0, 0, 1) + shift);
  m = glm::rotate(m, 3.14159265358979 - 0.5, glm::dvec3(1, 0, 0)); // board y up, camera y down
  return m;
}

/// Corners as the camera sees them, each moved by noise.
MarkerPose measured(const glm::dmat4& camera_from_board, std::mt19937* random = nullptr, double noise_px = 0.15) {
  std::normal_distribution<double> normal(0, noise_px);
  std::vector<SeenMarker> seen;
  for (const PlacedMarker& m : board().markers) {
    SeenMarker s{m.id, {}};
    for (std::size_t k = 0; k < 4; ++k) {
      const glm::dvec2 c = board_corners(m)[k];
      s.corner_px[k] = *lens().project(glm::dvec3(camera_from_board * glm::dvec4(c, 0.0, 1.0)));
      if (random)
        s.corner_px[k] += glm::dvec2(normal(*random), normal(*random));
    }
    seen.push_back(s);
  }
  return *marker_pose(seen, lens(), board(), glm::dmat4(1.0));
}

glm::dvec3 eye(const glm::dmat4& world_from_camera) { return glm::dvec3(world_from_camera[3]); }

TEST(PoseFilter, a_standing_camera_jitters_at_most_half_as_much) {
  std::mt19937 random(1);
  PoseFilter filter(lens(), board(), glm::dmat4(1.0));
  const glm::dvec3 truth = eye(glm::inverse(camera_from_board()));
  double raw = 0, filtered = 0;
  for (int k = 0; k < 300; ++k) {
    const MarkerPose pose = measured(camera_from_board(), &random);
    const TrackedPose tracked = filter.update(pose, k * kFrame_s);
    EXPECT_EQ(tracked.state, TrackingState::measured);
    if (k < 50)
      continue;
    raw += glm::dot(eye(pose.world_from_camera) - truth, eye(pose.world_from_camera) - truth);
    filtered += glm::dot(eye(tracked.world_from_camera) - truth, eye(tracked.world_from_camera) - truth);
  }
  // A first-order low pass of gain a leaves a / (2 - a) of the variance: 0.41 of the deviation at 25 frames/s, 0.12 s.
  EXPECT_LT(std::sqrt(filtered / raw), 0.5);
  EXPECT_GT(std::sqrt(filtered / raw), 0.3);
}

TEST(PoseFilter, a_moving_camera_lags_by_no_more_than_half_a_pixel) {
  PoseFilter filter(lens(), board(), glm::dmat4(1.0));
  for (const double speed : {0.01, 0.1, 1.0}) // metres per second, 6 to 600 pixels per second
    for (int k = 0; k < 10; ++k) {
      const glm::dmat4 truth = camera_from_board({speed * (k + 1) * kFrame_s - 0.2 * speed, 0, 0});
      const TrackedPose tracked = filter.update(measured(truth), k * kFrame_s + 100 * speed);
      double sum = 0;
      for (const PlacedMarker& m : board().markers)
        for (const glm::dvec2& c : board_corners(m)) {
          const glm::dvec4 p(c, 0.0, 1.0);
          const glm::dvec2 d = *lens().project(glm::dvec3(glm::inverse(tracked.world_from_camera) * p)) -
                               *lens().project(glm::dvec3(truth * p));
          sum += glm::dot(d, d);
        }
      EXPECT_LT(std::sqrt(sum / 16), 0.51) << speed << ", frame " << k;
    }
}

TEST(PoseFilter, a_short_loss_is_bridged_along_the_motion_and_a_long_one_is_called_lost) {
  PoseFilter filter(lens(), board(), glm::dmat4(1.0));
  const auto at = [](double t) { return camera_from_board({0.1 * t, 0.0, 0.05 * t}); };
  EXPECT_EQ(filter.update(nullptr, 0.0).state, TrackingState::lost) << "nothing is known yet";
  double t = 0;
  for (; t < 1.0; t += kFrame_s)
    filter.update(measured(at(t)), t);
  const double last = t - kFrame_s;
  for (; t < last + 0.24; t += kFrame_s) {
    const TrackedPose tracked = filter.update(nullptr, t);
    EXPECT_EQ(tracked.state, TrackingState::predicted);
    EXPECT_NEAR(tracked.age_s, t - last, 1e-9);
    const double error = glm::length(eye(tracked.world_from_camera) - eye(glm::inverse(at(t))));
    const double standing = glm::length(eye(glm::inverse(at(last))) - eye(glm::inverse(at(t))));
    EXPECT_LT(error, 0.002 + 0.2 * standing) << "at " << t;
  }
  EXPECT_EQ(filter.update(nullptr, last + 0.3).state, TrackingState::lost);
  EXPECT_FALSE(filter.update(nullptr, last + 0.3).usable());
  const TrackedPose again = filter.update(measured(at(0)), last + 5);
  EXPECT_EQ(again.state, TrackingState::measured);
  EXPECT_LT(glm::length(eye(again.world_from_camera) - eye(glm::inverse(at(0)))), 1e-4) << "starts afresh";
}

TEST(PoseFilter, an_ambiguous_view_keeps_the_last_sure_pose_and_says_so) {
  PoseFilter filter(lens(), board(), glm::dmat4(1.0));
  const TrackedPose sure = filter.update(measured(camera_from_board()), 0.0);
  MarkerPose unsure = measured(camera_from_board({0.05, 0, 0}));
  unsure.second_rms_px = unsure.reprojection_rms_px;
  ASSERT_TRUE(unsure.tilt_uncertain());
  const TrackedPose held = filter.update(unsure, kFrame_s);
  EXPECT_EQ(held.state, TrackingState::ambiguous);
  EXPECT_EQ(held.world_from_camera, sure.world_from_camera);
  EXPECT_EQ(filter.update(unsure, 10.0).state, TrackingState::lost);
}

} // namespace
} // namespace daylit
