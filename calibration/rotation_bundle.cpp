#include "calibration/rotation_bundle.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <opencv2/core.hpp>

#include "calibration/small_turn.h"

namespace daylit::calibration {

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kMatch = 0.08 * kDegree; ///< deviation of a match
constexpr double kHuber = 2.0;            ///< deviations, from where on matches count linearly
constexpr int kRounds = 30;
constexpr double kSettled = 1e-9; ///< radians

/// [v] x, so that cross(v, a) = skew(v) a.
glm::dmat3 skew(const glm::dvec3& v) { return {0, v.z, -v.y, -v.z, 0, v.x, v.y, -v.x, 0}; }

/// Normal equations of turns w, three numbers for each picture.
struct Normal {
  cv::Mat a, b;
  explicit Normal(std::size_t pictures)
      : a(cv::Mat::zeros(3 * static_cast<int>(pictures), 3 * static_cast<int>(pictures), CV_64F)),
        b(cv::Mat::zeros(3 * static_cast<int>(pictures), 1, CV_64F)) {}
  void add_block(std::size_t i, std::size_t j, const glm::dmat3& m) {
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c)
        a.at<double>(3 * static_cast<int>(i) + r, 3 * static_cast<int>(j) + c) += m[c][r];
  }
  void add_side(std::size_t i, const glm::dvec3& v) {
    for (int r = 0; r < 3; ++r)
      b.at<double>(3 * static_cast<int>(i) + r, 0) += v[r];
  }
};

/// r = (p + w_i x p) - (q + w_j x q): d r / d w_i = -[p] x, d r / d w_j = [q] x.
void add_match(Normal& normal, std::size_t i, std::size_t j, const glm::dvec3& p, const glm::dvec3& q) {
  const glm::dvec3 r = p - q;
  const double off = glm::length(r) / kMatch, weight = (off > kHuber ? kHuber / off : 1.0) / (kMatch * kMatch);
  const glm::dmat3 ji = -1.0 * skew(p), jj = skew(q), ti = weight * glm::transpose(ji),
                   tj = weight * glm::transpose(jj);
  normal.add_block(i, i, ti * ji);
  normal.add_block(i, j, ti * jj);
  normal.add_block(j, i, tj * ji);
  normal.add_block(j, j, tj * jj);
  normal.add_side(i, -(ti * r));
  normal.add_side(j, -(tj * r));
}

/// One Gauss-Newton step; the largest turn in it.
double improve(std::vector<HandHeldPicture>& pictures, std::span<const PictureMatch> matches,
               const std::vector<glm::dmat3>& rough, double sigma_rough) {
  Normal normal(pictures.size());
  const double prior = 1.0 / (sigma_rough * sigma_rough);
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    normal.add_block(i, i, glm::dmat3(prior));
    normal.add_side(i, -prior * turn_vector(pictures[i].world_from_camera * glm::transpose(rough[i])));
  }
  for (const PictureMatch& m : matches)
    for (const auto& [a, b] : m.directions)
      add_match(normal, m.first, m.second, pictures[m.first].world_from_camera * a,
                pictures[m.second].world_from_camera * b);
  cv::Mat x;
  if (!cv::solve(normal.a, normal.b, x, cv::DECOMP_CHOLESKY))
    return 0.0;
  double largest = 0.0;
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const int row = 3 * static_cast<int>(i);
    const glm::dvec3 w(x.at<double>(row, 0), x.at<double>(row + 1, 0), x.at<double>(row + 2, 0));
    pictures[i].world_from_camera = turn_by(w) * pictures[i].world_from_camera;
    largest = std::max(largest, glm::length(w));
  }
  return largest;
}

} // namespace

double align_pictures(std::vector<HandHeldPicture>& pictures, std::span<const PictureMatch> matches,
                      double sigma_rough) {
  std::vector<glm::dmat3> rough;
  for (const HandHeldPicture& p : pictures)
    rough.push_back(p.world_from_camera);
  for (int round = 0; round < kRounds; ++round)
    if (improve(pictures, matches, rough, sigma_rough) < kSettled)
      break;
  double sum = 0, count = 0;
  for (const PictureMatch& m : matches)
    for (const auto& [a, b] : m.directions) {
      const glm::dvec3 off = pictures[m.first].world_from_camera * a - pictures[m.second].world_from_camera * b;
      sum += glm::dot(off, off);
      ++count;
    }
  return count > 0 ? std::sqrt(sum / count) / kDegree : 0.0;
}

} // namespace daylit::calibration
