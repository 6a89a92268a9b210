#include "calibration/chart.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <opencv2/imgproc.hpp>
#include <opencv2/mcc.hpp>

namespace daylit::calibration {

namespace {

constexpr int kSearchWidth_px = 1200; ///< pictures are reduced to it before the chart is searched
constexpr float kSaturated = 0.98f;
constexpr int kAcross = 6, kDown = 4;
constexpr double kMiddle = 0.2; ///< of the distance between patches: half the side of what is sampled
// Middles of the first and last patches in the outline that cv::mcc gives, as fractions of its sides.
constexpr float kFirstX = 0.100f, kLastX = 0.900f, kFirstY = 0.143f, kLastY = 0.857f;

cv::Matx33d plane_to_picture(const ChartCorners& corners) {
  const std::vector<cv::Point2f> plane{{0, 0}, {kAcross - 1, 0}, {kAcross - 1, kDown - 1}, {0, kDown - 1}};
  std::vector<cv::Point2f> picture;
  for (const glm::dvec2& p : corners)
    picture.emplace_back(static_cast<float>(p.x), static_cast<float>(p.y));
  return cv::getPerspectiveTransform(plane, picture);
}

glm::dvec2 apply(const cv::Matx33d& h, double x, double y) {
  const cv::Vec3d p = h * cv::Vec3d(x, y, 1.0);
  return {p[0] / p[2], p[1] / p[2]};
}

float median(std::vector<float>& v) {
  const auto middle = v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2);
  std::ranges::nth_element(v, middle);
  return *middle;
}

/// 15 x 15 points over the middle of a patch.
bool sample_patch(const RgbImage& code, const cv::Matx33d& h, int column, int row, ChartPatch& patch) {
  std::array<std::vector<float>, 3> values;
  int saturated = 0;
  for (int v = -7; v <= 7; ++v)
    for (int u = -7; u <= 7; ++u) {
      const glm::dvec2 p = apply(h, column + kMiddle * u / 7, row + kMiddle * v / 7);
      const int x = static_cast<int>(std::lround(p.x)), y = static_cast<int>(std::lround(p.y));
      if (!(p.x >= 0 && p.y >= 0) || x >= code.width || y >= code.height)
        return false;
      for (int c = 0; c < 3; ++c)
        values[static_cast<std::size_t>(c)].push_back(code.at(x, y)[c]);
      const Rgb& t = code.at(x, y);
      saturated += std::max({t.r, t.g, t.b}) >= kSaturated ? 1 : 0;
    }
  for (int c = 0; c < 3; ++c)
    patch.code[c] = static_cast<double>(median(values[static_cast<std::size_t>(c)]));
  patch.saturated = saturated > 11; // of 225: 5 %
  patch.px = apply(h, column, row);
  patch.at = {(column - 2.5) / 5.0, (row - 1.5) / 5.0};
  return true;
}

} // namespace

std::optional<ChartCorners> find_chart(const Rgb8Image& picture) {
  const cv::Mat rgb(picture.height, picture.width, CV_8UC3, const_cast<std::uint8_t*>(picture.bytes.data()));
  cv::Mat bgr;
  cv::cvtColor(rgb, bgr, cv::COLOR_RGB2BGR);
  const double scale = std::min(1.0, static_cast<double>(kSearchWidth_px) / std::max(picture.width, picture.height));
  if (scale < 1.0)
    cv::resize(bgr, bgr, {}, scale, scale, cv::INTER_AREA);
  try {
    const auto detector = cv::mcc::CCheckerDetector::create();
    if (!detector->process(bgr, cv::mcc::MCC24, 1))
      return std::nullopt;
    const std::vector<cv::Point2f> box = detector->getBestColorChecker()->getBox();
    const std::vector<cv::Point2f> unit{{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    const cv::Matx33d h = cv::getPerspectiveTransform(unit, box);
    ChartCorners corners;
    const cv::Point2f at[] = {{kFirstX, kFirstY}, {kLastX, kFirstY}, {kLastX, kLastY}, {kFirstX, kLastY}};
    for (std::size_t k = 0; k < 4; ++k)
      corners[k] = apply(h, static_cast<double>(at[k].x), static_cast<double>(at[k].y)) / scale;
    return corners;
  } catch (const cv::Exception&) {
    return std::nullopt;
  }
}

double turn_of(const ChartCorners& corners) {
  const glm::dvec2 row = corners[1] - corners[0] + corners[2] - corners[3];
  return std::atan2(row.y, row.x) * 180.0 / std::numbers::pi;
}

std::optional<std::array<ChartPatch, kPatches>> sample_chart(const RgbImage& code, const ChartCorners& corners) {
  const cv::Matx33d h = plane_to_picture(corners);
  std::array<ChartPatch, kPatches> patches;
  for (int k = 0; k < static_cast<int>(kPatches); ++k)
    if (!sample_patch(code, h, k % kAcross, k / kAcross, patches[static_cast<std::size_t>(k)]))
      return std::nullopt;
  return patches;
}

} // namespace daylit::calibration
