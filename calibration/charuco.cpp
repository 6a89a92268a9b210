#include "calibration/charuco.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <opencv2/imgproc.hpp>

#include "capture/markers/find_markers.h"

namespace daylit::calibration {

namespace {

constexpr int kSearchSide = 2000;   ///< pixels, longest side of the picture in which markers are searched
constexpr double kAgree = 0.2;      ///< of a square: what two markers may differ in where they expect a corner
constexpr double kMostAgree = 0.7;  ///< of the corners between two markers
constexpr double kRatio = 0.04;     ///< of square / marker: measured beside stated,
constexpr double kRatio_px = 2.0;   ///< and what the sides of markers may be off by
constexpr double kStay = 0.25;      ///< of a square: how far a corner may lie from where markers expect it
constexpr std::size_t kMarkers = 4; ///< from which a picture shows a board
constexpr double kChance = 0.15;    ///< of the markers: others than the board's, which a pattern passed for
constexpr int kWidestBoard = 40;    ///< squares in a row that are tried where the board is not as stated

/// Picture from the plane of a marker whose sides are 1, middle (0, 0), y down.
using Plane = cv::Matx33d;

Plane plane_of(const SeenMarker& marker) {
  const std::vector<cv::Point2f> unit{{-0.5f, -0.5f}, {0.5f, -0.5f}, {0.5f, 0.5f}, {-0.5f, 0.5f}};
  std::vector<cv::Point2f> corners;
  for (const glm::dvec2& p : marker.corner_px)
    corners.emplace_back(static_cast<float>(p.x), static_cast<float>(p.y));
  return cv::getPerspectiveTransform(unit, corners);
}

glm::dvec2 apply(const cv::Matx33d& h, const glm::dvec2& at) {
  const cv::Vec3d p = h * cv::Vec3d(at.x, at.y, 1.0);
  return {p[0] / p[2], p[1] / p[2]};
}

/// The markers of one picture, each with the plane that it spans.
struct Markers {
  std::map<int, Plane> plane; ///< by id
};

/// How squares and ids lie.
struct Arrangement {
  int columns = 0; ///< squares in a row
  bool black_first = true;
  double ratio = 1.0; ///< square / marker
};

/// Where markers expect an inner corner, in pixels: one entry per marker that touches it.
using Expected = std::map<std::pair<int, int>, std::vector<glm::dvec2>>;

/// Inner corner (c, r) lies between squares (c, r) and (c + 1, r + 1).
Expected expected_corners(const Markers& markers, const Arrangement& a) {
  Expected expected;
  for (const auto& [id, plane] : markers.plane) {
    const glm::ivec2 square = square_of_marker(id, a.columns, a.black_first);
    for (const int y : {-1, 0})
      for (const int x : {-1, 0})
        expected[{square.x + x, square.y + y}].push_back(apply(plane, a.ratio * glm::dvec2(x + 0.5, y + 0.5)));
  }
  return expected;
}

/// Side of a square at a corner, pixels.
double square_px(const Plane& plane, double ratio) {
  return ratio * std::sqrt(glm::distance(apply(plane, {-0.5, -0.5}), apply(plane, {0.5, 0.5})) *
                           glm::distance(apply(plane, {-0.5, 0.5}), apply(plane, {0.5, -0.5})) / 2.0);
}

double usual_square_px(const Markers& markers, double ratio) {
  std::vector<double> side;
  for (const auto& [id, plane] : markers.plane)
    side.push_back(square_px(plane, ratio));
  std::ranges::nth_element(side, side.begin() + static_cast<std::ptrdiff_t>(side.size() / 2));
  return side[side.size() / 2];
}

/// Of the corners between two markers: the part at which both expect the corner in the same place.
double agreement(const Markers& markers, const Arrangement& a) {
  const double within = kAgree * usual_square_px(markers, a.ratio);
  double agree = 0, all = 0;
  for (const auto& [corner, at] : expected_corners(markers, a))
    if (at.size() == 2) {
      ++all;
      agree += glm::distance(at[0], at[1]) < within ? 1 : 0;
    }
  return all > 0 ? agree / all : 0.0;
}

/// Square / marker as the picture shows it: the median distance of diagonal neighbours, in markers.
double measured_ratio(const Markers& markers, const Arrangement& a) {
  std::map<std::pair<int, int>, const Plane*> at;
  for (const auto& [id, plane] : markers.plane) {
    const glm::ivec2 s = square_of_marker(id, a.columns, a.black_first);
    at[{s.x, s.y}] = &plane;
  }
  std::vector<double> ratios;
  for (const auto& [square, plane] : at)
    for (const int x : {-1, 1})
      if (const auto next = at.find({square.first + x, square.second + 1}); next != at.end()) {
        const glm::dvec2 d = apply(plane->inv(), apply(*next->second, {0, 0})),
                         back = apply(next->second->inv(), apply(*plane, {0, 0}));
        ratios.push_back(std::sqrt(0.5 * glm::length(d) * glm::length(back)));
      }
  if (ratios.empty())
    return a.ratio;
  std::ranges::nth_element(ratios, ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2));
  return ratios[ratios.size() / 2];
}

/// The better of the two ways to begin, with the ratio that the picture shows.
Arrangement arranged(const Markers& markers, int columns, double ratio) {
  Arrangement best;
  double most = -1;
  for (const bool black_first : {true, false}) {
    Arrangement a{columns, black_first, ratio};
    a.ratio = measured_ratio(markers, a);
    if (const double agree = a.ratio > 1.0 && a.ratio < 4.0 ? agreement(markers, a) : 0.0; agree > most) {
      most = agree;
      best = a;
    }
  }
  return best;
}

/// The number of squares in a row at which the markers lie as on a board; 0: at none.
int columns_shown(const Markers& markers, double ratio) {
  int best = 0;
  double most = kMostAgree;
  for (int columns = 3; columns <= kWidestBoard; ++columns)
    if (const double agree = agreement(markers, arranged(markers, columns, ratio)); agree > most) {
      most = agree;
      best = columns;
    }
  return best;
}

Rgb8Image reduced(const Rgb8Image& picture, double scale) {
  const cv::Mat whole(picture.height, picture.width, CV_8UC3, const_cast<std::uint8_t*>(picture.bytes.data()));
  cv::Mat small;
  cv::resize(whole, small, {}, scale, scale, cv::INTER_AREA);
  return {small.cols, small.rows, std::vector<std::uint8_t>(small.data, small.data + 3 * small.total())};
}

Result<Markers> markers_in(const Rgb8Image& picture, const std::string& dictionary) {
  const double scale = std::min(1.0, double(kSearchSide) / std::max(picture.width, picture.height));
  auto seen = find_markers(scale < 1.0 ? reduced(picture, scale) : picture, dictionary);
  if (!seen)
    return seen.error();
  Markers markers;
  for (SeenMarker& marker : *seen) {
    for (glm::dvec2& p : marker.corner_px)
      p = (p + 0.5) / scale - 0.5;
    markers.plane[marker.id] = plane_of(marker);
  }
  return markers;
}

/// The dictionary whose markers the picture shows, among the largest of each family.
std::string dictionary_shown(const Rgb8Image& picture) {
  for (const char* name : {"4X4_1000", "5X5_1000", "6X6_1000", "7X7_1000", "ARUCO_ORIGINAL", "APRILTAG_36h11"})
    if (const auto markers = markers_in(picture, name); markers && markers->plane.size() >= kMarkers)
      return name;
  return {};
}

/// Why markers do not lie as `target` says; empty: they do.
std::string fault_of(const Markers& markers, const Target& target, const Arrangement& a) {
  const int columns = target.size.columns + 1, rows = target.size.rows + 1;
  const double stated = target.square_m / target.marker_m;
  const bool agrees = agreement(markers, a) >= kMostAgree;
  if (const int shown = agrees ? columns : columns_shown(markers, stated); shown != columns)
    return shown > 0
               ? fmt::format("{}{} inner corners in a row, not {}", kOtherBoard, shown - 1, columns - 1)
               : "its markers do not lie as on a ChArUco board of this size: another board, or two in one picture";
  const auto beyond = std::ranges::count_if(markers.plane, [&](const auto& marker) {
    return square_of_marker(marker.first, columns, a.black_first).y >= rows;
  });
  if (static_cast<double>(beyond) > kChance * static_cast<double>(markers.plane.size()))
    return fmt::format("{}more rows: marker {} is not on one of {} x {} inner corners", kOtherBoard,
                       markers.plane.rbegin()->first, target.size.columns, target.size.rows);
  const double marker_px = usual_square_px(markers, 1.0);
  if (std::abs(a.ratio / stated - 1.0) > kRatio + kRatio_px / marker_px)
    return fmt::format("its squares are {:.1f} times as wide as its markers, --square and --marker say {:.2f}", a.ratio,
                       stated);
  return {};
}

/// Corners where the markers expect them, drawn to the saddle point; those that wander off are left out.
FoundBoard refined(const Rgb8Image& picture, const Target& target, const Markers& markers, const Arrangement& a) {
  const double side = usual_square_px(markers, a.ratio);
  std::vector<cv::Point2f> corners;
  std::vector<glm::dvec3> places;
  for (const auto& [corner, at] : expected_corners(markers, a)) {
    if (corner.first < 0 || corner.second < 0 || corner.first >= target.size.columns ||
        corner.second >= target.size.rows)
      continue;
    const glm::dvec2 middle = at.size() == 2 ? 0.5 * (at[0] + at[1]) : at[0];
    if (at.size() == 2 && glm::distance(at[0], at[1]) > kAgree * side)
      continue;
    if (middle.x < 2 || middle.y < 2 || middle.x > picture.width - 3 || middle.y > picture.height - 3)
      continue;
    corners.emplace_back(static_cast<float>(middle.x), static_cast<float>(middle.y));
    places.emplace_back(target.square_m * corner.first, target.square_m * corner.second, 0.0);
  }
  FoundBoard found;
  if (corners.size() < kFewestCorners)
    return found;
  const std::vector<cv::Point2f> expected = corners;
  const int half = std::clamp(static_cast<int>(0.5 * side * (1.0 - 1.0 / a.ratio)), 2, 11); // no marker inside
  cv::Mat grey;
  cv::cvtColor(cv::Mat(picture.height, picture.width, CV_8UC3, const_cast<std::uint8_t*>(picture.bytes.data())), grey,
               cv::COLOR_RGB2GRAY);
  cv::cornerSubPix(grey, corners, {half, half}, {-1, -1}, {cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 60, 1e-3});
  for (std::size_t k = 0; k < corners.size(); ++k)
    if (cv::norm(corners[k] - expected[k]) < kStay * side) {
      found.corner_px.emplace_back(double(corners[k].x), double(corners[k].y));
      found.board_m.push_back(places[k]);
    }
  return found;
}

} // namespace

/// Every other square holds a marker; a row of an odd number of them begins as the one before did not.
glm::ivec2 square_of_marker(int id, int columns, bool black_first) {
  const int in_two_rows = columns, pair = id / in_two_rows;
  int rest = id % in_two_rows, row = 2 * pair;
  const int in_first = black_first ? columns / 2 : (columns + 1) / 2;
  bool skip = black_first; // the row begins with a black square
  if (rest >= in_first) {
    rest -= in_first;
    ++row;
    skip = !skip;
  }
  return {2 * rest + (skip ? 1 : 0), row};
}

Result<FoundBoard> find_charuco(const Rgb8Image& picture, const Target& target) {
  const auto markers = markers_in(picture, target.dictionary);
  if (!markers)
    return markers.error();
  FoundBoard found;
  if (markers->plane.size() < kMarkers) {
    const std::string other = dictionary_shown(picture), why = why_not_visible(picture);
    found.why = !other.empty() && !target.dictionary.ends_with(other)
                    ? "shows markers of the dictionary " + other + ", not of " + target.dictionary
                : why == kNotVisible ? "markers of " + target.dictionary + " are not visible; come closer"
                                     : why;
    return found;
  }
  Arrangement a = arranged(*markers, target.size.columns + 1, target.square_m / target.marker_m);
  found.why = fault_of(*markers, target, a);
  if (!found.why.empty())
    return found;
  a.ratio = target.square_m / target.marker_m; // the sides of small markers are seen too short
  found = refined(picture, target, *markers, a);
  if (found.corner_px.size() < kFewestCorners)
    return FoundBoard{{}, {}, fmt::format("fewer than {} corners of the board are visible", kFewestCorners)};
  return found;
}

} // namespace daylit::calibration
