#include "calibration/room_marker_fit.h"

#include <cmath>
#include <utility>

#include <glm/matrix.hpp>
#include <opencv2/core.hpp>

#include "calibration/small_turn.h"
#include "capture/markers/board.h"

namespace daylit::calibration::room_markers {

namespace {

constexpr int kRounds = 100;
constexpr double kSettled = 1e-10;
constexpr double kStep = 1e-6; ///< of numeric derivatives, metres and radians
constexpr double kUnseen_px = 1e3;

/// Unknowns: places of surfaces, six of each camera, three of each marker.
std::size_t unknowns(const State& s) { return kPlaces + 6 * s.camera.size() + 3 * s.marker.size(); }

void change(State& s, std::size_t unknown, double by) {
  if (unknown < kPlaces) {
    s.place[unknown] += by;
    return;
  }
  unknown -= kPlaces;
  if (unknown < 6 * s.camera.size()) {
    Camera& c = s.camera[unknown / 6];
    const auto k = static_cast<glm::length_t>(unknown % 6);
    glm::dvec3 v(0.0);
    v[k % 3] = by;
    if (k < 3)
      c.turn = turn_by(v) * c.turn;
    else
      c.position += v;
    return;
  }
  unknown -= 6 * s.camera.size();
  Marker& m = s.marker[unknown / 3];
  (unknown % 3 == 0 ? m.place.x : unknown % 3 == 1 ? m.place.y : m.turn) += by;
}

/// Those that a sighting depends on.
std::vector<std::size_t> unknowns_of(const State& s, const Sighting& seen) {
  std::vector<std::size_t> which;
  if (kSurfaces[s.marker[seen.marker].surface].is_far)
    which.push_back(s.marker[seen.marker].surface);
  for (std::size_t k = 0; k < 6; ++k)
    which.push_back(kPlaces + 6 * seen.camera + k);
  for (std::size_t k = 0; k < 3; ++k)
    which.push_back(kPlaces + 6 * s.camera.size() + 3 * seen.marker + k);
  return which;
}

} // namespace

glm::dvec3 corner_in_room(const State& s, std::size_t marker, const glm::dvec2& on_marker) {
  const Marker& m = s.marker[marker];
  const Surface& surface = kSurfaces[m.surface];
  const double c = std::cos(m.turn), n = std::sin(m.turn);
  const glm::dvec2 at = m.place + glm::dvec2(c * on_marker.x - n * on_marker.y, n * on_marker.x + c * on_marker.y);
  glm::dvec3 p = at.x * surface.u + at.y * surface.v;
  p[surface.axis] = s.place[m.surface];
  return p;
}

Fit::Fit(const LensModel& lens, double side_m, std::vector<Sighting> sightings)
    : lens_(lens), corner_(board_corners({0, side_m, glm::dvec2(0.0)})), sightings_(std::move(sightings)) {}

std::array<double, 8> Fit::residual(const State& s, const Sighting& seen) const {
  std::array<double, 8> r{};
  const Camera& camera = s.camera[seen.camera];
  for (std::size_t k = 0; k < 4; ++k) {
    const auto at =
        lens_.project(glm::transpose(camera.turn) * (corner_in_room(s, seen.marker, corner_[k]) - camera.position));
    r[2 * k] = at ? seen.corner_px[k].x - at->x : kUnseen_px;
    r[2 * k + 1] = at ? seen.corner_px[k].y - at->y : kUnseen_px;
  }
  return r;
}
double Fit::cost(const State& s) const {
  double sum = 0;
  for (const Sighting& seen : sightings_)
    for (const double r : residual(s, seen))
      sum += r * r;
  return sum;
}
/// Unknowns: places of surfaces, six of each camera, three of each marker.
struct Fit::Normal {
  cv::Mat1d a, b;
};

Fit::Normal Fit::normal_equations(const State& s) const {
  const int n = static_cast<int>(unknowns(s));
  cv::Mat1d a(n, n, 0.0), b(n, 1, 0.0);
  for (const Sighting& seen : sightings_) {
    const std::vector<std::size_t> which = unknowns_of(s, seen);
    std::vector<std::array<double, 8>> slope;
    for (const std::size_t unknown : which) {
      State more = s, less = s;
      change(more, unknown, kStep);
      change(less, unknown, -kStep);
      const auto p = residual(more, seen), q = residual(less, seen);
      slope.emplace_back();
      for (std::size_t k = 0; k < 8; ++k)
        slope.back()[k] = (p[k] - q[k]) / (2 * kStep);
    }
    const auto r = residual(s, seen);
    for (std::size_t i = 0; i < which.size(); ++i)
      for (std::size_t k = 0; k < 8; ++k) {
        b(static_cast<int>(which[i])) -= slope[i][k] * r[k];
        for (std::size_t j = 0; j < which.size(); ++j)
          a(static_cast<int>(which[i]), static_cast<int>(which[j])) += slope[i][k] * slope[j][k];
      }
  }
  for (int i = 0; i < n; ++i) // surfaces that no marker is on
    if (a(i, i) == 0.0)
      a(i, i) = 1.0;
  return {a, b};
}

std::array<double, kPlaces> Fit::refine(State& s) const {
  cv::Mat1d x;
  double damping = 1e-3, now = cost(s);
  for (int round = 0; round < kRounds && damping < 1e12; ++round) {
    auto [a, b] = normal_equations(s);
    for (int i = 0; i < a.rows; ++i)
      a(i, i) *= 1.0 + damping;
    State moved = s;
    if (cv::solve(a, b, x, cv::DECOMP_CHOLESKY))
      for (int i = 0; i < x.rows; ++i)
        change(moved, static_cast<std::size_t>(i), x(i));
    const double then = cost(moved);
    if (!(then < now)) {
      damping *= 10;
      continue;
    }
    const bool settled = now - then < kSettled * now;
    s = std::move(moved);
    now = then;
    damping = std::max(0.1 * damping, 1e-12);
    if (settled)
      break;
  }
  const cv::Mat1d covariance(normal_equations(s).a.inv(cv::DECOMP_SVD));
  std::array<double, kPlaces> variance{};
  for (std::size_t k = 0; k < kPlaces; ++k)
    variance[k] = covariance(static_cast<int>(k), static_cast<int>(k));
  return variance;
}

} // namespace daylit::calibration::room_markers
