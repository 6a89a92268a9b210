#include "calibration/orientation_fit.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <opencv2/core.hpp>

namespace daylit::calibration {

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kFewestApart_deg = 3.0; ///< two directions nearer than this leave the turn about them open
constexpr int kRounds = 5;

double angle_deg(const glm::dvec3& a, const glm::dvec3& b) {
  return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b)) / kDegree;
}

// Wahba's problem by singular values (Markley 1988): the rotation R with the least sum |w - R c|^2.
glm::dmat3 rotation_of(const std::vector<Sighting>& sightings, const std::vector<bool>& used) {
  cv::Matx33d b = cv::Matx33d::zeros();
  for (std::size_t i = 0; i < sightings.size(); ++i)
    if (used[i])
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c)
          b(r, c) += sightings[i].world[r] * sightings[i].camera[c];
  cv::Matx33d u, vt;
  cv::Matx31d s;
  cv::SVD::compute(b, s, u, vt);
  const double sign = cv::determinant(u) * cv::determinant(vt);
  const cv::Matx33d rotation = u * cv::Matx33d(1, 0, 0, 0, 1, 0, 0, 0, sign < 0 ? -1 : 1) * vt;
  glm::dmat3 m;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c)
      m[c][r] = rotation(r, c);
  return m;
}

std::vector<double> errors_of(const glm::dmat3& rotation, const std::vector<Sighting>& sightings) {
  std::vector<double> errors;
  for (const Sighting& s : sightings)
    errors.push_back(angle_deg(rotation * s.camera, s.world));
  return errors;
}

std::vector<bool> within(const std::vector<double>& errors, double tolerance) {
  std::vector<bool> used;
  for (const double e : errors)
    used.push_back(e <= tolerance);
  return used;
}

/// Of all pairs the one whose rotation most sightings agree with (Fischler & Bolles 1981, with every pair tried).
std::vector<bool> consensus(const std::vector<Sighting>& sightings, double tolerance_deg) {
  std::vector<bool> best(sightings.size());
  double most = 0;
  for (std::size_t i = 0; i < sightings.size(); ++i)
    for (std::size_t j = i + 1; j < sightings.size(); ++j) {
      const double in_camera = angle_deg(sightings[i].camera, sightings[j].camera);
      const double in_world = angle_deg(sightings[i].world, sightings[j].world);
      if (in_world < kFewestApart_deg || std::abs(in_camera - in_world) > 2 * tolerance_deg)
        continue;
      std::vector<bool> pair(sightings.size());
      pair[i] = pair[j] = true;
      const std::vector<double> errors = errors_of(rotation_of(sightings, pair), sightings);
      double agree = 0;
      for (const double e : errors)
        agree += std::max(0.0, 1.0 - e * e / (tolerance_deg * tolerance_deg));
      if (agree > most) {
        most = agree;
        best = within(errors, tolerance_deg);
      }
    }
  return best;
}

// Covariance s^2 (sum I - d d^T)^-1 of the turn; its largest deviation.
double deviation(const std::vector<Sighting>& sightings, const std::vector<bool>& used, double scatter_deg) {
  glm::dmat3 information(0.0);
  for (std::size_t i = 0; i < sightings.size(); ++i)
    if (used[i])
      information += glm::dmat3(1.0) - glm::outerProduct(sightings[i].world, sightings[i].world);
  cv::Matx33d m;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c)
      m(r, c) = information[c][r];
  cv::Matx31d values;
  cv::eigen(m, values);
  return scatter_deg / std::sqrt(std::max(values(2), 1e-9));
}

double largest_change(const std::vector<Sighting>& sightings, const OrientationFit& fit) {
  double largest = 0;
  for (std::size_t i = 0; i < sightings.size(); ++i)
    if (fit.used[i]) {
      std::vector<bool> others = fit.used;
      others[i] = false;
      if (std::ranges::count(others, true) >= 2)
        largest = std::max(largest, turn_between(rotation_of(sightings, others), fit.world_from_camera));
    }
  return largest;
}

} // namespace

double turn_between(const glm::dmat3& a, const glm::dmat3& b) {
  const glm::dmat3 turn = glm::transpose(a) * b;
  const glm::dvec3 axis(turn[1][2] - turn[2][1], turn[2][0] - turn[0][2], turn[0][1] - turn[1][0]);
  return std::atan2(glm::length(axis), turn[0][0] + turn[1][1] + turn[2][2] - 1.0) / kDegree;
}

Result<OrientationFit> fit_orientation(const std::vector<Sighting>& sightings, double tolerance_deg,
                                       std::size_t fewest) {
  OrientationFit fit;
  fit.used = consensus(sightings, tolerance_deg);
  for (int round = 0; round < kRounds && std::ranges::count(fit.used, true) >= 2; ++round) {
    fit.world_from_camera = rotation_of(sightings, fit.used);
    fit.error_deg = errors_of(fit.world_from_camera, sightings);
    fit.used = within(fit.error_deg, tolerance_deg);
  }
  const auto agree = static_cast<std::size_t>(std::ranges::count(fit.used, true));
  if (agree < std::max<std::size_t>(fewest, 2))
    return Error{ErrorCode::value_invalid, fmt::format("only {} of {} directions agree", agree, sightings.size()),
                 "orientation", "check times, place and lens, and take more of them"};
  double sum = 0;
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    sum += fit.used[i] ? fit.error_deg[i] * fit.error_deg[i] : 0.0;
    for (std::size_t j = 0; j < i; ++j)
      if (fit.used[i] && fit.used[j])
        fit.spread_deg = std::max(fit.spread_deg, angle_deg(sightings[i].world, sightings[j].world));
  }
  fit.rms_deg = std::sqrt(sum / static_cast<double>(agree));
  // 2 n observed angles, 3 of them spent on the turn; the scatter is that of one angle.
  const double free = std::max(2.0 * static_cast<double>(agree) - 3.0, 1.0);
  fit.sigma_deg = deviation(sightings, fit.used, std::max(std::sqrt(sum / free), kLeastScatter_deg));
  fit.held_out_deg = largest_change(sightings, fit);
  return fit;
}

} // namespace daylit::calibration
