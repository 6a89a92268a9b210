#include "capture/markers/find_markers.h"

#include <algorithm>
#include <iterator>
#include <optional>

#include <opencv2/core/version.hpp>
#include <opencv2/imgproc.hpp>
#if CV_VERSION_MAJOR > 4 || CV_VERSION_MINOR >= 7
#include <opencv2/objdetect/aruco_detector.hpp>
#else
#include <opencv2/aruco.hpp>
#endif

#include "capture/markers/edge_corners.h"

namespace daylit {

namespace {

/// In the order of OpenCV's enumeration.
constexpr const char* kDictionaries[] = {
    "4X4_50",   "4X4_100",  "4X4_250",        "4X4_1000",      "5X5_50",        "5X5_100",        "5X5_250",
    "5X5_1000", "6X6_50",   "6X6_100",        "6X6_250",       "6X6_1000",      "7X7_50",         "7X7_100",
    "7X7_250",  "7X7_1000", "ARUCO_ORIGINAL", "APRILTAG_16h5", "APRILTAG_25h9", "APRILTAG_36h10", "APRILTAG_36h11"};
static_assert(std::size(kDictionaries) == cv::aruco::DICT_APRILTAG_36h11 + 1);

using Corners = std::vector<std::vector<cv::Point2f>>;

// The only lines that differ between OpenCV 4.6 (aruco of opencv_contrib) and 4.7 and later (objdetect).
#if CV_VERSION_MAJOR > 4 || CV_VERSION_MINOR >= 7
cv::aruco::Dictionary predefined(int k) { return cv::aruco::getPredefinedDictionary(k); }

void detect(const cv::Mat& grey, const cv::aruco::Dictionary& dictionary, Corners& corners, std::vector<int>& ids) {
  cv::aruco::DetectorParameters parameters;
  parameters.cornerRefinementMethod = cv::aruco::CORNER_REFINE_NONE;
  cv::aruco::ArucoDetector(dictionary, parameters).detectMarkers(grey, corners, ids);
}
#else
cv::aruco::Dictionary predefined(int k) { return *cv::aruco::getPredefinedDictionary(k); }

void detect(const cv::Mat& grey, const cv::aruco::Dictionary& dictionary, Corners& corners, std::vector<int>& ids) {
  const auto parameters = cv::aruco::DetectorParameters::create();
  parameters->cornerRefinementMethod = cv::aruco::CORNER_REFINE_NONE;
  cv::aruco::detectMarkers(grey, cv::makePtr<cv::aruco::Dictionary>(dictionary), corners, ids, parameters);
}
#endif

std::string plain_name(const std::string& name) { return name.rfind("DICT_", 0) == 0 ? name.substr(5) : name; }

std::optional<cv::aruco::Dictionary> dictionary_named(const std::string& name) {
  const std::string plain = plain_name(name);
  const auto found = std::find(std::begin(kDictionaries), std::end(kDictionaries), plain);
  if (found == std::end(kDictionaries))
    return std::nullopt;
  return predefined(static_cast<int>(found - kDictionaries));
}

Error unknown_dictionary(const std::string& name) {
  std::string known;
  for (const char* name_of_one : kDictionaries)
    known.append(known.empty() ? "" : ", ").append(name_of_one);
  return {ErrorCode::usage, "unknown marker dictionary \"" + name.substr(0, 40) + "\"", "[marker] dictionary",
          "known are " + known};
}

/// Half turns from OpenCV's print of a marker to the one that its authors publish. OpenCV 4.6 holds the codes of the
/// four AprilTag families upside down: read row by row from the top left, white = 1, tag 0 of 36h11 is 0xd5d628584 in
/// the AprilTag library's picture (Olson 2011; Wang & Olson 2016) and in OpenCV's after half a turn.
bool upside_down(const std::string& dictionary) { return plain_name(dictionary).rfind("APRILTAG_", 0) == 0; }

SeenMarker upright(int id, const std::vector<cv::Point2f>& corners, std::size_t quarter_turns) {
  SeenMarker marker{id, {}};
  for (std::size_t k = 0; k < 4; ++k)
    marker.corner_px[(k + quarter_turns) % 4] = {double(corners[k].x), double(corners[k].y)};
  return marker;
}

} // namespace

Result<std::vector<SeenMarker>> find_markers(const Rgb8Image& picture, const std::string& dictionary, double exponent) {
  const auto known = dictionary_named(dictionary);
  if (!known)
    return unknown_dictionary(dictionary);
  try {
    cv::Mat colour(picture.height, picture.width, CV_8UC3, const_cast<std::uint8_t*>(picture.bytes.data())), grey;
    cv::cvtColor(colour, grey, cv::COLOR_RGB2GRAY);
    Corners corners;
    std::vector<int> ids;
    detect(grey, *known, corners, ids);
    std::vector<SeenMarker> seen;
    for (std::size_t i = 0; i < ids.size(); ++i)
      seen.push_back(upright(ids[i], corners[i], upside_down(dictionary) ? 2 : 0));
    if (seen.empty())
      return seen;
    const detail::GreyImage light = detail::linear_grey(picture, exponent);
    for (SeenMarker& marker : seen)
      detail::fit_square_edges(light, marker.corner_px);
    std::sort(seen.begin(), seen.end(), [](const SeenMarker& a, const SeenMarker& b) { return a.id < b.id; });
    return seen;
  } catch (const cv::Exception& error) {
    return Error{ErrorCode::value_invalid, std::string("the marker search failed (") + error.err + ")", "picture", ""};
  }
}

Result<MarkerPrint> marker_print(const std::string& dictionary, int id) {
  const auto known = dictionary_named(dictionary);
  if (!known)
    return unknown_dictionary(dictionary);
  if (id < 0 || id >= known->bytesList.rows)
    return Error{ErrorCode::usage, "there is no marker " + std::to_string(id) + " in " + plain_name(dictionary),
                 "[marker] ids", "ids go from 0 to " + std::to_string(known->bytesList.rows - 1)};
  const int inside = known->markerSize;
  const cv::Mat bits = cv::aruco::Dictionary::getBitsFromByteList(known->bytesList.rowRange(id, id + 1), inside);
  MarkerPrint print{inside + 2, std::vector<std::uint8_t>(static_cast<std::size_t>((inside + 2) * (inside + 2)), 0)};
  for (int row = 0; row < inside; ++row)
    for (int column = 0; column < inside; ++column) {
      const bool turned = upside_down(dictionary);
      const int from_row = turned ? inside - 1 - row : row, from_column = turned ? inside - 1 - column : column;
      print.white[static_cast<std::size_t>((row + 1) * print.cells_per_side + column + 1)] =
          bits.at<std::uint8_t>(from_row, from_column) ? 1 : 0;
    }
  return print;
}

Result<BoardLayout> board_of(const MarkerConfig& marker) {
  for (const int id : marker.ids)
    if (const auto print = marker_print(marker.dictionary, id); !print)
      return print.error();
  if (marker.columns > 0)
    return BoardLayout::grid(marker.dictionary, marker.ids, marker.columns, marker.size_m, marker.gap_m);
  if (marker.ids.size() != 1)
    return Error{ErrorCode::value_invalid, "several markers need their places on the board", "[marker] ids",
                 "give columns and gap_m, or one id: its centre is the board's origin then"};
  return BoardLayout::single(marker.dictionary, marker.ids.front(), marker.size_m);
}

} // namespace daylit
