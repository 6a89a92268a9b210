#pragma once

// Boards before a known lens: corners with noise, and pictures.

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include "calibration/checkerboard.h"
#include "calibration/lens_fit.h"

namespace daylit::test {

constexpr double kDegree = std::numbers::pi / 180.0;

/// A fish-eye of 190 degrees in a circle of 1,060 pixels.
inline LensModel true_fisheye() {
  LensModel lens;
  lens.kind = LensKind::equidistant;
  lens.width_px = 1280;
  lens.height_px = 1120;
  lens.fx = 321.5;
  lens.fy = 321.1;
  lens.cx = 633.7;
  lens.cy = 566.2;
  lens.distortion = {-0.012, 0.006, -0.003, 0.0005};
  lens.max_theta = 100 * kDegree;
  return lens;
}

inline LensModel true_camera() {
  LensModel lens;
  lens.width_px = 1280;
  lens.height_px = 960;
  lens.fx = 1040.0;
  lens.fy = 1043.0;
  lens.cx = 655.0;
  lens.cy = 470.0;
  lens.distortion = {-0.21, 0.08, 0.0007, -0.0004, 0.01};
  return lens;
}

/// A board in the direction `at` (angle from the axis, turn about it), tilted and turned.
inline calibration::BoardPose board_at(std::span<const glm::dvec3> board, double theta, double phi, double distance_m,
                                       double tilt, double turn) {
  glm::dvec3 middle(0.0);
  for (const glm::dvec3& p : board)
    middle += p / static_cast<double>(board.size());
  const glm::dquat to = glm::angleAxis(phi, glm::dvec3(0, 0, 1)) * glm::angleAxis(theta, glm::dvec3(0, 1, 0));
  const glm::dquat q = to * glm::angleAxis(tilt, glm::normalize(glm::dvec3(std::cos(turn), std::sin(turn), 0))) *
                       glm::angleAxis(turn, glm::dvec3(0, 0, 1));
  const glm::dvec3 v = (q.w < 0 ? -1.0 : 1.0) * glm::dvec3(q.x, q.y, q.z);
  const double sine = std::max(glm::length(v), 1e-300);
  return {2.0 * std::atan2(sine, std::abs(q.w)) / sine * v, to * glm::dvec3(0, 0, distance_m) - q * middle};
}

/// Corners with Gaussian noise of so many pixels; false where one has no image.
inline bool look(const LensModel& lens, const calibration::BoardPose& pose, std::span<const glm::dvec3> board,
                 double noise_px, std::mt19937& random, std::vector<glm::dvec2>& out) {
  std::normal_distribution<double> noise(0.0, noise_px);
  out.clear();
  for (const glm::dvec3& p : board) {
    const auto at = lens.project(pose.apply(p));
    if (!at || at->x < 1 || at->y < 1 || at->x > lens.width_px - 2 || at->y > lens.height_px - 2)
      return false;
    out.push_back(*at + glm::dvec2(noise(random), noise(random)));
  }
  return true;
}

inline bool go_on(const std::string&, double) { return true; }

inline const calibration::BoardSize kBoard{12, 9};
constexpr double kSquare_m = 0.025;

/// Eight good views of a fish-eye whose corners reach 85 % of the circle, and two of a board that is 8 % too long.
inline std::vector<calibration::BoardView> fisheye_views(std::mt19937& random, double noise_px, bool with_wrong_ones) {
  const LensModel lens = true_fisheye();
  const auto board = calibration::board_points(kBoard.columns, kBoard.rows, kSquare_m);
  auto bent = board;
  for (glm::dvec3& p : bent)
    p.x *= 1.0 + 0.08 * p.x / 0.275;
  std::uniform_real_distribution<double> u(0.0, 1.0);
  const double radius = lens.project({std::sin(95 * kDegree), 0, std::cos(95 * kDegree)})->x - lens.cx;
  std::vector<calibration::BoardView> views;
  for (int v = 0; v < (with_wrong_ones ? 10 : 8); ++v)
    for (std::vector<glm::dvec2> corners; corners.empty();) {
      const double theta = v == 0 ? 0.1 : (46 + 10 * u(random)) * kDegree;
      const auto pose = board_at(board, theta, 2 * std::numbers::pi * (v + 0.3 * u(random)) / 7,
                                 0.24 + 0.06 * u(random), (15 + 20 * u(random)) * kDegree, 6.28 * u(random));
      const bool seen = look(lens, pose, v >= 8 ? bent : board, noise_px, random, corners);
      const bool reaches = std::ranges::any_of(
          corners, [&](const glm::dvec2& p) { return glm::distance(p, glm::dvec2(lens.cx, lens.cy)) > 0.85 * radius; });
      if (seen && (reaches || v == 0))
        views.push_back({(v >= 8 ? "wrong" : "good") + std::to_string(v), corners, board});
      else
        corners.clear();
    }
  std::ranges::shuffle(views, random);
  return views;
}

inline calibration::ImageCircle circle_of(const LensModel& lens, double theta) {
  return {{lens.cx, lens.cy}, lens.project({std::sin(theta), 0, std::cos(theta)})->x - lens.cx};
}

/// Largest angle between what two lenses say of the pixels inside a part of the circle, degrees, apart from a turn of
/// the whole camera, which alignment finds: the turn w with least sum |a - b - w x b|^2.
inline double angle_error(const LensModel& a, const LensModel& b, const calibration::ImageCircle& circle, double part) {
  std::vector<std::array<glm::dvec3, 2>> pairs;
  glm::dmat3 normal(0.0);
  glm::dvec3 right(0.0);
  for (double r = 0; r <= part * circle.radius; r += 0.02 * circle.radius)
    for (int k = 0; k < 24; ++k) {
      const double phi = 2 * std::numbers::pi * k / 24;
      const glm::dvec2 p = circle.centre + r * glm::dvec2(std::cos(phi), std::sin(phi));
      const auto da = a.unproject(p), db = b.unproject(p);
      if (!da || !db)
        return 180;
      pairs.push_back({*da, *db});
      normal += glm::dmat3(1.0) - glm::outerProduct(*db, *db);
      right += glm::cross(*db, *da - *db);
    }
  const glm::dvec3 turn = glm::inverse(normal) * right;
  double worst = 0;
  for (const auto& [da, db] : pairs)
    worst = std::max(worst, glm::length(da - db - glm::cross(turn, db)) / kDegree);
  return worst;
}

} // namespace daylit::test
