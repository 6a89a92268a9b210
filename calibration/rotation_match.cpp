#include "calibration/rotation_match.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "scene/core/parallel_stage.h"
#include "scene/image/image_formats.h"

namespace daylit::calibration {

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr int kFeatures = 1200;     ///< of a picture, the strongest
constexpr int kSearchSide = 640;    ///< pixels: features are searched in a picture of at most this side
constexpr double kContrast = 0.015; ///< least contrast of a feature (0.04 in Lowe 2004): exposures are often dark
constexpr float kRatio = 0.85f;     ///< nearest / second nearest descriptor
constexpr double kInlier = 0.35 * kDegree;
constexpr std::size_t kFewest = 8;    ///< inliers of a pair,
constexpr double kShare = 0.25;       ///< and of its matches
constexpr std::size_t kMostKept = 80; ///< matches of a pair that go on
constexpr int kTrials = 300;

struct Features {
  std::vector<glm::dvec3> direction; ///< camera frame
  cv::Mat descriptors;
};

/// sRGB-encoded brightness of a picture that is reduced for the search, and where features may lie: away from what is
/// saturated.
struct SearchPicture {
  cv::Mat grey, mask;
  double scale = 1.0;
};

SearchPicture to_search(const HandHeldPicture& picture) {
  const RgbImage& light = picture.light;
  cv::Mat y(light.height, light.width, CV_32F), usable(light.height, light.width, CV_8U);
  for (int row = 0; row < light.height; ++row)
    for (int x = 0; x < light.width; ++x) {
      y.at<float>(row, x) = luminance(light.at(x, row));
      usable.at<std::uint8_t>(row, x) = picture.usable[static_cast<std::size_t>(row) * light.width + x] ? 255 : 0;
    }
  SearchPicture search;
  search.scale = std::min(1.0, double(kSearchSide) / std::max(light.width, light.height));
  cv::resize(y, y, {}, search.scale, search.scale, cv::INTER_AREA);
  cv::resize(usable, search.mask, y.size(), 0, 0, cv::INTER_NEAREST);
  cv::erode(search.mask, search.mask, cv::Mat::ones(9, 9, CV_8U), {-1, -1}, 1, cv::BORDER_CONSTANT, 255);
  search.grey.create(y.size(), CV_8U);
  for (int row = 0; row < y.rows; ++row)
    for (int x = 0; x < y.cols; ++x)
      search.grey.at<std::uint8_t>(row, x) =
          static_cast<std::uint8_t>(std::lround(255.0f * srgb_encode(std::clamp(y.at<float>(row, x), 0.0f, 1.0f))));
  return search;
}

Features features_of(const HandHeldPicture& picture) {
  const SearchPicture search = to_search(picture);
  std::vector<cv::KeyPoint> points;
  Features features;
  cv::Mat descriptors;
  cv::SIFT::create(kFeatures, 3, kContrast)->detectAndCompute(search.grey, search.mask, points, descriptors);
  for (int k = 0; k < static_cast<int>(points.size()); ++k) {
    const cv::Point2f& p = points[static_cast<std::size_t>(k)].pt;
    const auto d = picture.lens.unproject((glm::dvec2(double(p.x), double(p.y)) + 0.5) / search.scale - 0.5);
    if (!d)
      continue;
    features.direction.push_back(*d);
    features.descriptors.push_back(descriptors.row(k));
  }
  return features;
}

double angle_between(const glm::dvec3& a, const glm::dvec3& b) {
  return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}

/// Turns by this angle: trace R = 1 + 2 cos.
double angle_of(const glm::dmat3& r) {
  return std::acos(std::clamp(0.5 * (r[0][0] + r[1][1] + r[2][2] - 1.0), -1.0, 1.0));
}

/// Matches by descriptor that the rough orientations allow.
std::vector<std::array<glm::dvec3, 2>> candidates(const Features& a, const Features& b, const glm::dmat3& a_from_b,
                                                  double most_off) {
  std::vector<std::array<glm::dvec3, 2>> pairs;
  if (a.direction.size() < kFewest || b.direction.size() < kFewest)
    return pairs;
  std::vector<std::vector<cv::DMatch>> nearest;
  cv::BFMatcher(cv::NORM_L2).knnMatch(b.descriptors, a.descriptors, nearest, 2);
  for (const auto& two : nearest) {
    if (two.size() < 2 || two[0].distance > kRatio * two[1].distance)
      continue;
    const glm::dvec3 &p = a.direction[static_cast<std::size_t>(two[0].trainIdx)],
                     &q = b.direction[static_cast<std::size_t>(two[0].queryIdx)];
    if (angle_between(p, a_from_b * q) < most_off)
      pairs.push_back({p, q});
  }
  return pairs;
}

std::vector<std::array<glm::dvec3, 2>> inliers(const std::vector<std::array<glm::dvec3, 2>>& pairs,
                                               const glm::dmat3& rotation) {
  std::vector<std::array<glm::dvec3, 2>> good;
  for (const auto& pair : pairs)
    if (angle_between(pair[0], rotation * pair[1]) < kInlier)
      good.push_back(pair);
  return good;
}

/// The rotation that most of the pairs agree on; pairs that agree, or none.
std::vector<std::array<glm::dvec3, 2>> agreeing(const std::vector<std::array<glm::dvec3, 2>>& pairs,
                                                const glm::dmat3& rough, double most_off, std::uint32_t seed) {
  std::vector<std::array<glm::dvec3, 2>> best;
  if (pairs.size() < kFewest)
    return best;
  std::mt19937 random(seed);
  std::uniform_int_distribution<std::size_t> pick(0, pairs.size() - 1);
  for (int trial = 0; trial < kTrials; ++trial) {
    const std::array<std::array<glm::dvec3, 2>, 2> two{pairs[pick(random)], pairs[pick(random)]};
    if (angle_between(two[0][0], two[1][0]) < 2.0 * kDegree)
      continue;
    const glm::dmat3 rotation = rotation_between(two);
    if (angle_of(glm::transpose(rough) * rotation) > most_off)
      continue;
    if (auto good = inliers(pairs, rotation); good.size() > best.size())
      best = std::move(good);
  }
  if (best.size() < kFewest)
    return {};
  best = inliers(pairs, rotation_between(best));
  if (best.size() < kFewest || static_cast<double>(best.size()) < kShare * static_cast<double>(pairs.size()))
    return {};
  std::ranges::shuffle(best, random);
  best.resize(std::min(best.size(), kMostKept));
  return best;
}

/// Half of the picture's diagonal, radians.
double half_view(const HandHeldPicture& p) {
  const auto corner = p.lens.unproject({0, 0});
  return corner ? std::acos(std::clamp(corner->z, -1.0, 1.0)) : p.lens.max_theta;
}

std::vector<std::array<std::size_t, 2>> overlapping(std::span<const HandHeldPicture> pictures, double most_off) {
  std::vector<std::array<std::size_t, 2>> pairs;
  for (std::size_t i = 0; i < pictures.size(); ++i)
    for (std::size_t j = i + 1; j < pictures.size(); ++j)
      if (angle_between(pictures[i].world_from_camera[2], pictures[j].world_from_camera[2]) <
          0.85 * (half_view(pictures[i]) + half_view(pictures[j])) + most_off)
        pairs.push_back({i, j});
  return pairs;
}

} // namespace

/// From the singular values of sum b a^T (Arun, Huang & Blostein 1987), mirroring excluded.
glm::dmat3 rotation_between(std::span<const std::array<glm::dvec3, 2>> directions) {
  cv::Matx33d sum = cv::Matx33d::zeros();
  for (const auto& [a, b] : directions)
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c)
        sum(r, c) += a[r] * b[c];
  cv::Matx33d u, vt;
  cv::Vec3d w;
  cv::SVD::compute(sum, w, u, vt);
  const double mirrored = cv::determinant(u * vt) < 0 ? -1.0 : 1.0;
  const cv::Matx33d r = u * cv::Matx33d(1, 0, 0, 0, 1, 0, 0, 0, mirrored) * vt;
  glm::dmat3 rotation;
  for (int row = 0; row < 3; ++row)
    for (int c = 0; c < 3; ++c)
      rotation[c][row] = r(row, c);
  return rotation;
}

Result<std::vector<PictureMatch>> match_pictures(std::span<const HandHeldPicture> pictures, double most_off,
                                                 const Progress& progress) {
  std::vector<Features> features(pictures.size());
  const auto found = parallel_stage("features", pictures.size(), 1, progress,
                                    [&](std::size_t i) { features[i] = features_of(pictures[i]); });
  if (!found)
    return found.error();
  const auto pairs = overlapping(pictures, most_off);
  std::vector<PictureMatch> matches(pairs.size());
  const auto matched = parallel_stage("matches", pairs.size(), 1, progress, [&](std::size_t k) {
    const auto [i, j] = pairs[k];
    const glm::dmat3 rough = glm::transpose(pictures[i].world_from_camera) * pictures[j].world_from_camera;
    matches[k] = {i, j,
                  agreeing(candidates(features[i], features[j], rough, most_off), rough, most_off,
                           static_cast<std::uint32_t>(k))};
  });
  if (!matched)
    return matched.error();
  std::erase_if(matches, [](const PictureMatch& m) { return m.directions.empty(); });
  return matches;
}

} // namespace daylit::calibration
