#include "calibration/rotation_bundle.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/matrix.hpp>
#include <opencv2/core.hpp>

#include "scene/core/parallel_stage.h"

namespace daylit::calibration {

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kMatch = 0.08 * kDegree; ///< deviation of a match
constexpr double kHuber = 2.0;            ///< deviations, from where on matches count linearly
constexpr int kRounds = 30;
constexpr double kSettled = 1e-9; ///< radians
constexpr std::size_t kSamples = 20000;
constexpr float kDark = 0.08f, kBright = 0.85f; ///< of full scale: well exposed in between
constexpr std::size_t kFewestSamples = 30;
constexpr double kPairDeviation = 0.02; ///< of the median of a pair's ratios
constexpr double kFarFromAxis = 0.9;    ///< of the picture: what lies further out has no part

/// exp of a rotation vector.
glm::dmat3 turned(const glm::dvec3& v) {
  const double angle = glm::length(v);
  return angle > 0 ? glm::mat3_cast(glm::angleAxis(angle, v / angle)) : glm::dmat3(1.0);
}

/// The rotation vector of a small turn: the antisymmetric part.
glm::dvec3 vector_of(const glm::dmat3& r) {
  const glm::dvec3 v = 0.5 * glm::dvec3(r[1][2] - r[2][1], r[2][0] - r[0][2], r[0][1] - r[1][0]);
  const double sine = glm::length(v), cosine = 0.5 * (r[0][0] + r[1][1] + r[2][2] - 1.0);
  return sine > 1e-12 ? std::atan2(sine, cosine) / sine * v : v;
}

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
    normal.add_side(i, -prior * vector_of(pictures[i].world_from_camera * glm::transpose(rough[i])));
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
    pictures[i].world_from_camera = turned(w) * pictures[i].world_from_camera;
    largest = std::max(largest, glm::length(w));
  }
  return largest;
}

/// log of the mean luminance of 3 x 3 texels per exposure; nothing where one is saturated or the mean is not well
/// exposed.
std::optional<double> log_radiance(const HandHeldPicture& p, const glm::dvec3& world) {
  const glm::dvec3 d = glm::transpose(p.world_from_camera) * world;
  const auto at = d.z > 0 ? p.lens.project(d) : std::nullopt;
  if (!at)
    return std::nullopt;
  const int x = static_cast<int>(std::lround(at->x)), y = static_cast<int>(std::lround(at->y));
  const double edge = 0.5 * (1.0 - kFarFromAxis);
  if (x < edge * p.light.width || y < edge * p.light.height || x > (1 - edge) * p.light.width - 2 ||
      y > (1 - edge) * p.light.height - 2)
    return std::nullopt;
  float sum = 0.0f;
  for (int v = -1; v <= 1; ++v)
    for (int u = -1; u <= 1; ++u) {
      if (!p.usable[static_cast<std::size_t>(y + v) * p.light.width + x + u])
        return std::nullopt;
      sum += luminance(p.light.at(x + u, y + v)) / 9.0f;
    }
  if (sum < kDark || sum > kBright)
    return std::nullopt;
  return std::log(static_cast<double>(sum) / p.exposure);
}

double median(std::vector<double>& v) {
  const auto middle = v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2);
  std::ranges::nth_element(v, middle);
  return *middle;
}

struct PairRatio {
  std::size_t first, second;
  double log_ratio; ///< of the radiances that they show
};

Result<std::vector<PairRatio>> pair_ratios(const std::vector<HandHeldPicture>& pictures, const Progress& progress) {
  const std::vector<glm::dvec3> directions = even_directions(kSamples);
  std::vector<std::vector<double>> value(pictures.size(), std::vector<double>(kSamples, NAN));
  const auto done = parallel_stage("exposures", pictures.size(), 1, progress, [&](std::size_t i) {
    for (std::size_t k = 0; k < kSamples; ++k)
      value[i][k] = log_radiance(pictures[i], directions[k]).value_or(NAN);
  });
  if (!done)
    return done.error();
  std::vector<PairRatio> ratios;
  for (std::size_t i = 0; i < pictures.size(); ++i)
    for (std::size_t j = i + 1; j < pictures.size(); ++j) {
      std::vector<double> both;
      for (std::size_t k = 0; k < kSamples; ++k)
        if (const double r = value[i][k] - value[j][k]; !std::isnan(r))
          both.push_back(r);
      if (both.size() >= kFewestSamples)
        ratios.push_back({i, j, median(both)});
    }
  return ratios;
}

} // namespace

std::vector<glm::dvec3> even_directions(std::size_t count) {
  std::vector<glm::dvec3> directions;
  for (std::size_t i = 0; i < count; ++i) {
    const double z = 1.0 - (2.0 * static_cast<double>(i) + 1.0) / static_cast<double>(count),
                 r = std::sqrt(1.0 - z * z), phi = 2.399963229728653 * static_cast<double>(i);
    directions.emplace_back(r * std::cos(phi), r * std::sin(phi), z);
  }
  return directions;
}

AlignedPictures align_pictures(std::vector<HandHeldPicture>& pictures, std::span<const PictureMatch> matches,
                               double sigma_rough) {
  std::vector<glm::dmat3> rough;
  for (const HandHeldPicture& p : pictures)
    rough.push_back(p.world_from_camera);
  for (int round = 0; round < kRounds; ++round)
    if (improve(pictures, matches, rough, sigma_rough) < kSettled)
      break;
  AlignedPictures result{std::vector<bool>(pictures.size(), false), 0.0, 0.0};
  std::size_t count = 0;
  for (const PictureMatch& m : matches) {
    result.aligned[m.first] = result.aligned[m.second] = true;
    for (const auto& [a, b] : m.directions) {
      const glm::dvec3 off = pictures[m.first].world_from_camera * a - pictures[m.second].world_from_camera * b;
      result.rms_deg += glm::dot(off, off);
      ++count;
    }
  }
  result.rms_deg = count > 0 ? std::sqrt(result.rms_deg / static_cast<double>(count)) / kDegree : 0.0;
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const glm::dvec3 v = vector_of(pictures[i].world_from_camera * glm::transpose(rough[i])) / kDegree;
    result.moved_rms_deg += glm::dot(v, v) / static_cast<double>(pictures.size());
  }
  result.moved_rms_deg = std::sqrt(result.moved_rms_deg);
  return result;
}

/// With e the logarithms of true over stated exposure: sum (e_i - e_j - r_ij)^2 / kPairDeviation^2 + sum e^2 /
/// kStatedExposure^2.
Result<RefinedExposures> refine_exposures(std::vector<HandHeldPicture>& pictures, const Progress& progress) {
  const auto ratios = pair_ratios(pictures, progress);
  if (!ratios)
    return ratios.error();
  const int n = static_cast<int>(pictures.size());
  const double pair = 1.0 / (kPairDeviation * kPairDeviation), stated = 1.0 / (kStatedExposure * kStatedExposure);
  cv::Mat a = stated * cv::Mat::eye(n, n, CV_64F), b = cv::Mat::zeros(n, 1, CV_64F), e;
  for (const PairRatio& r : *ratios) {
    const int i = static_cast<int>(r.first), j = static_cast<int>(r.second);
    a.at<double>(i, i) += pair;
    a.at<double>(j, j) += pair;
    a.at<double>(i, j) -= pair;
    a.at<double>(j, i) -= pair;
    b.at<double>(i, 0) += pair * r.log_ratio;
    b.at<double>(j, 0) -= pair * r.log_ratio;
  }
  cv::solve(a, b, e, cv::DECOMP_CHOLESKY);
  RefinedExposures refined;
  refined.pairs = ratios->size();
  for (const PairRatio& r : *ratios) {
    const double left =
        r.log_ratio - e.at<double>(static_cast<int>(r.first), 0) + e.at<double>(static_cast<int>(r.second), 0);
    refined.disagreement += left * left / static_cast<double>(ratios->size());
  }
  refined.disagreement = std::sqrt(refined.disagreement);
  for (int i = 0; i < n; ++i) {
    refined.measured_over_stated.push_back(std::exp(e.at<double>(i, 0)));
    pictures[static_cast<std::size_t>(i)].exposure *= refined.measured_over_stated.back();
  }
  return refined;
}

} // namespace daylit::calibration
