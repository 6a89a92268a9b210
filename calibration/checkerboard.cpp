#include "calibration/checkerboard.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

namespace daylit::calibration {

namespace {

constexpr int kSearchSide = 1400;     ///< pixels, longest side of the picture that is searched
constexpr double kOverExposed = 0.35; ///< of the pixels at their largest value
constexpr int kTop = 254;             ///< codes from here on may stand for any amount of light
constexpr double kWhiteLost = 0.5;    ///< of the white pixels of a board: at the top
constexpr double kDark = 12.0;        ///< of 255: brightest twentieth
constexpr double kSharp = 30.0;       ///< variance of the Laplacian at the search size
/// Of the mean brightness: outside of the circle. The one that gives the roundest circle, as noise may be brighter.
constexpr double kDarkBorder[] = {0.12, 0.25, 0.5, 0.7};
constexpr double kRound = 0.012; ///< rms distance of the border from the circle / radius
constexpr std::size_t kBorderPoints = 60;
constexpr const char* kBlurred = "blurred: no sharp edge in it; hold the camera still, or use more light";

cv::Mat grey_of(const Rgb8Image& picture) {
  const cv::Mat rgb(picture.height, picture.width, CV_8UC3, const_cast<std::uint8_t*>(picture.bytes.data()));
  cv::Mat grey;
  cv::cvtColor(rgb, grey, cv::COLOR_RGB2GRAY);
  return grey;
}

/// The picture at most kSearchSide wide and high, and its pixels per pixel of the original.
std::pair<cv::Mat, double> to_search_size(const cv::Mat& grey) {
  const double scale = std::min(1.0, double(kSearchSide) / std::max(grey.cols, grey.rows));
  cv::Mat small = grey;
  if (scale < 1.0)
    cv::resize(grey, small, {}, scale, scale, cv::INTER_AREA);
  return {small, scale};
}

/// The method that looks for squares, at one threshold.
std::vector<cv::Point2f> quick_search(const cv::Mat& small, BoardSize size) {
  std::vector<cv::Point2f> corners;
  return cv::findChessboardCorners(small, {size.columns, size.rows}, corners, 0) ? corners : std::vector<cv::Point2f>{};
}

/// Of a picture at the search size.
std::string why_not_visible(const cv::Mat& small) {
  const double pixels = static_cast<double>(small.total());
  if (cv::countNonZero(small >= 254) > kOverExposed * pixels)
    return "over-exposed: a third of the picture is white; expose less";
  if (cv::countNonZero(small > kDark) < 0.05 * pixels)
    return "too dark; expose more";
  cv::Mat quiet, laplacian; // without the noise, which is sharp
  cv::medianBlur(small, quiet, 5);
  cv::Laplacian(quiet, laplacian, CV_64F);
  cv::Scalar mean, deviation;
  cv::meanStdDev(laplacian, mean, deviation);
  if (deviation[0] * deviation[0] < kSharp)
    return kBlurred;
  return kNotVisible;
}

/// Inner corners of the largest checkerboard that the picture shows, whatever its size (Duda & Frese 2018); 0: none.
cv::Size shown_size(const cv::Mat& small) {
  std::vector<cv::Point2f> corners;
  cv::Mat meta;
  const int how = cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_LARGER;
  return cv::findChessboardCornersSB(small, {3, 3}, corners, how, meta) ? meta.size() : cv::Size(0, 0);
}

bool same_size(const cv::Size& shown, BoardSize size) {
  return shown == cv::Size(size.columns, size.rows) || shown == cv::Size(size.rows, size.columns);
}

/// The method that looks for squares, the one that looks for saddle points (which sees some where all is blurred), and
/// where a picture that is well exposed shows less than half a board the first one at many thresholds: that takes half
/// a minute where there is another board.
std::vector<cv::Point2f> search(const cv::Mat& small, BoardSize size) {
  const cv::Size board(size.columns, size.rows);
  std::vector<cv::Point2f> corners = quick_search(small, size);
  const std::string why = corners.empty() ? why_not_visible(small) : "";
  if (!corners.empty() || why == kBlurred ||
      cv::findChessboardCornersSB(small, board, corners, cv::CALIB_CB_NORMALIZE_IMAGE))
    return corners;
  if (why == kNotVisible && 2 * shown_size(small).area() < board.area() &&
      cv::findChessboardCorners(small, board, corners, cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE))
    return corners;
  return {};
}

/// Half of the shortest distance between neighbouring corners: a window that holds one corner.
int window_of(const std::vector<cv::Point2f>& corners, BoardSize size) {
  double shortest = 1e9;
  for (int y = 0; y < size.rows; ++y)
    for (int x = 0; x + 1 < size.columns; ++x) {
      const auto i = static_cast<std::size_t>(y * size.columns + x);
      shortest = std::min(shortest, cv::norm(corners[i + 1] - corners[i]));
    }
  for (std::size_t i = 0; i + static_cast<std::size_t>(size.columns) < corners.size(); ++i)
    shortest = std::min(shortest, cv::norm(corners[i + static_cast<std::size_t>(size.columns)] - corners[i]));
  return std::clamp(static_cast<int>(0.4 * shortest), 2, 11);
}

/// Algebraic circle through points: least squares of x^2 + y^2 + a x + b y + c (Kasa 1976).
ImageCircle circle_through(const std::vector<glm::dvec2>& points) {
  cv::Mat m(static_cast<int>(points.size()), 3, CV_64F), b(static_cast<int>(points.size()), 1, CV_64F), x;
  for (int i = 0; i < m.rows; ++i) {
    const glm::dvec2& p = points[static_cast<std::size_t>(i)];
    m.at<double>(i, 0) = p.x;
    m.at<double>(i, 1) = p.y;
    m.at<double>(i, 2) = 1.0;
    b.at<double>(i, 0) = -(p.x * p.x + p.y * p.y);
  }
  if (!cv::solve(m, b, x, cv::DECOMP_SVD))
    return {};
  const glm::dvec2 centre(-0.5 * x.at<double>(0), -0.5 * x.at<double>(1));
  return {centre, std::sqrt(std::max(centre.x * centre.x + centre.y * centre.y - x.at<double>(2), 0.0))};
}

double rms_distance(const std::vector<glm::dvec2>& points, const ImageCircle& circle) {
  double sum = 0;
  for (const glm::dvec2& p : points)
    sum += std::pow(std::hypot(p.x - circle.centre.x, p.y - circle.centre.y) - circle.radius, 2);
  return std::sqrt(sum / static_cast<double>(points.size()));
}

struct RoundOutline {
  ImageCircle circle;
  double off = 0; ///< rms distance of the outline / radius
};

/// Circle through the points of the largest outline of what is bright that do not lie on the picture's border.
std::optional<RoundOutline> circle_around(const cv::Mat& bright) {
  std::vector<std::vector<cv::Point>> outlines;
  cv::findContours(bright, outlines, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  if (outlines.empty())
    return std::nullopt;
  const auto& largest = *std::ranges::max_element(
      outlines, {}, [](const std::vector<cv::Point>& o) { return std::abs(cv::contourArea(o)); });
  std::vector<glm::dvec2> border;
  for (const cv::Point& p : largest)
    if (p.x > 2 && p.y > 2 && p.x < bright.cols - 3 && p.y < bright.rows - 3)
      border.emplace_back(p.x, p.y);
  if (border.size() < kBorderPoints)
    return std::nullopt;
  const ImageCircle circle = circle_through(border);
  return circle.radius > 0 && circle.radius < std::hypot(bright.cols, bright.rows)
             ? std::optional(RoundOutline{circle, rms_distance(border, circle) / circle.radius})
             : std::nullopt;
}

} // namespace

std::optional<std::vector<glm::dvec2>> find_checkerboard(const Rgb8Image& picture, BoardSize size) {
  const cv::Mat grey = grey_of(picture);
  const auto [small, scale] = to_search_size(grey);
  std::vector<cv::Point2f> corners = search(small, size);
  if (corners.empty())
    return std::nullopt;
  for (cv::Point2f& c : corners) // pixel centres are whole numbers on either side
    c = {static_cast<float>((double(c.x) + 0.5) / scale - 0.5), static_cast<float>((double(c.y) + 0.5) / scale - 0.5)};
  const int half = window_of(corners, size);
  cv::cornerSubPix(grey, corners, {half, half}, {-1, -1}, {cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 60, 1e-3});
  std::vector<glm::dvec2> found;
  for (const cv::Point2f& c : corners)
    found.emplace_back(double(c.x), double(c.y));
  return found;
}

std::string why_not_found(const Rgb8Image& picture, BoardSize size) {
  const cv::Mat small = to_search_size(grey_of(picture)).first;
  const std::string why = why_not_visible(small);
  if (why != kNotVisible) // what is found in a blurred picture is no board
    return why;
  const cv::Size shown = shown_size(small);
  if (shown.width == 0 || same_size(shown, size))
    return why;
  return fmt::format("{}{} x {} inner corners, not {} x {}: another board, or only a part of it is visible",
                     kOtherBoard, std::max(shown.width, shown.height), std::min(shown.width, shown.height),
                     size.columns, size.rows);
}

std::string why_not_visible(const Rgb8Image& picture) {
  return why_not_visible(to_search_size(grey_of(picture)).first);
}

/// White are pixels between the corners that are nearer to the 95th percentile of these than to the 5th.
bool white_is_lost(const Rgb8Image& picture, const std::vector<glm::dvec2>& corner_px) {
  std::vector<cv::Point> corners, outline;
  for (const glm::dvec2& p : corner_px)
    corners.emplace_back(static_cast<int>(std::lround(p.x)), static_cast<int>(std::lround(p.y)));
  cv::convexHull(corners, outline);
  const cv::Mat grey = grey_of(picture);
  cv::Mat board = cv::Mat::zeros(grey.size(), CV_8U);
  cv::fillConvexPoly(board, outline, 255);
  std::vector<std::uint8_t> codes;
  for (int y = 0; y < grey.rows; ++y)
    for (int x = 0; x < grey.cols; ++x)
      if (board.at<std::uint8_t>(y, x) > 0)
        codes.push_back(grey.at<std::uint8_t>(y, x));
  if (codes.empty())
    return false;
  std::ranges::sort(codes);
  const int black = codes[codes.size() / 20], white = codes[codes.size() - 1 - codes.size() / 20];
  const auto from = [&](int code) { return codes.end() - std::ranges::lower_bound(codes, code); };
  return static_cast<double>(from(kTop)) > kWhiteLost * static_cast<double>(from((black + white) / 2));
}

void CircleFinder::add(const Rgb8Image& picture) {
  if (brightest_.empty()) {
    width_ = picture.width;
    height_ = picture.height;
    brightest_.assign(static_cast<std::size_t>(width_) * height_, 0);
  }
  if (picture.width != width_ || picture.height != height_)
    return;
  for (std::size_t i = 0; i < brightest_.size(); ++i)
    brightest_[i] = std::max({brightest_[i], picture.bytes[3 * i], picture.bytes[3 * i + 1], picture.bytes[3 * i + 2]});
}

ImageCircle CircleFinder::find() const {
  if (brightest_.empty())
    return {};
  cv::Mat bright = cv::Mat(height_, width_, CV_8U, const_cast<std::uint8_t*>(brightest_.data())).clone();
  cv::medianBlur(bright, bright, 5);
  const double mean = cv::mean(bright)[0];
  RoundOutline best{{}, kRound};
  for (const double border : kDarkBorder)
    if (const auto found = circle_around(bright > std::max(border * mean, 8.0)); found && found->off < best.off)
      best = *found;
  return best.circle;
}

} // namespace daylit::calibration
