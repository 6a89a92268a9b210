#include "runtime/input/marker_pose.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>

#include <glm/matrix.hpp>
#include <glm/vec4.hpp>
#include <opencv2/aruco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "runtime/input/edge_corners.h"

namespace daylit {

namespace {

constexpr double kSamePose = 0.02;       // radians: as well as a small marker says its tilt
constexpr double kEquallyGood = 2.0;     // ratio of the rms of two poses
constexpr double kCornerNoise_px = 0.05; // of find_markers()

/// In the order of OpenCV's enumeration.
constexpr const char* kDictionaries[] = {
    "4X4_50",   "4X4_100",  "4X4_250",        "4X4_1000",      "5X5_50",        "5X5_100",        "5X5_250",
    "5X5_1000", "6X6_50",   "6X6_100",        "6X6_250",       "6X6_1000",      "7X7_50",         "7X7_100",
    "7X7_250",  "7X7_1000", "ARUCO_ORIGINAL", "APRILTAG_16h5", "APRILTAG_25h9", "APRILTAG_36h10", "APRILTAG_36h11"};
static_assert(std::size(kDictionaries) == cv::aruco::DICT_APRILTAG_36h11 + 1);

std::string plain_name(const std::string& name) { return name.rfind("DICT_", 0) == 0 ? name.substr(5) : name; }

/// Quarter turns from OpenCV's print of a marker to the one that its authors publish. OpenCV holds the codes of the
/// four AprilTag families upside down: read row by row from the top left, white = 1, tag 0 of 36h11 is 0xd5d628584 in
/// the AprilTag library's picture and in OpenCV's after half a turn.
std::size_t quarter_turns(const std::string& dictionary) {
  return plain_name(dictionary).rfind("APRILTAG_", 0) == 0 ? 2 : 0;
}

std::string list_ids(const std::vector<int>& ids) {
  std::string text;
  for (const int id : ids)
    text.append(text.empty() ? "" : " ").append(std::to_string(id));
  return text.empty() ? "none" : text;
}

std::optional<cv::Ptr<cv::aruco::Dictionary>> dictionary_named(const std::string& name) {
  const std::string plain = plain_name(name);
  const auto found = std::find(std::begin(kDictionaries), std::end(kDictionaries), plain);
  if (found == std::end(kDictionaries))
    return std::nullopt;
  return cv::aruco::getPredefinedDictionary(static_cast<int>(found - kDictionaries));
}

/// The sum of the code values: a camera's curve is smooth enough not to shift the steepest point of an edge.
detail::GreyImage grey_image(const Rgb8Image& picture) {
  detail::GreyImage image{picture.width, picture.height, std::vector<float>(picture.bytes.size() / 3)};
  for (std::size_t i = 0; i < image.value.size(); ++i)
    image.value[i] = static_cast<float>(picture.bytes[3 * i] + picture.bytes[3 * i + 1] + picture.bytes[3 * i + 2]);
  return image;
}

Error unknown_dictionary(const std::string& name) {
  std::string known;
  for (const char* name_of_one : kDictionaries)
    known.append(known.empty() ? "" : ", ").append(name_of_one);
  return {ErrorCode::usage, "unknown marker dictionary \"" + name.substr(0, 40) + "\"", "[marker] dictionary",
          "known are " + known};
}

/// Points on the board (metres) and the rays that see them (z = 1), one of each per marker corner.
struct Correspondence {
  std::vector<cv::Point3d> board;
  std::vector<cv::Point2d> ray;
  std::vector<glm::dvec2> pixel;
  std::vector<int> ids;
};

Correspondence match(const std::vector<SeenMarker>& seen, const LensModel& lens, const BoardLayout& board) {
  Correspondence c;
  for (const PlacedMarker& placed : board.markers)
    for (const SeenMarker& marker : seen) {
      if (marker.id != placed.id)
        continue;
      const std::array<glm::dvec2, 4> corners = board_corners(placed);
      std::array<glm::dvec3, 4> rays;
      bool in_field = true;
      for (std::size_t k = 0; k < 4 && in_field; ++k) {
        const std::optional<glm::dvec3> ray = lens.unproject(marker.corner_px[k]);
        in_field = ray && ray->z > 1e-3;
        rays[k] = in_field ? *ray : glm::dvec3(0, 0, 1);
      }
      if (!in_field)
        continue;
      c.ids.push_back(marker.id);
      for (std::size_t k = 0; k < 4; ++k) {
        c.board.emplace_back(corners[k].x, corners[k].y, 0.0);
        c.ray.emplace_back(rays[k].x / rays[k].z, rays[k].y / rays[k].z);
        c.pixel.push_back(marker.corner_px[k]);
      }
    }
  return c;
}

struct Candidate {
  glm::dmat4 camera_from_board{1.0};
  double rms_px = std::numeric_limits<double>::infinity();
};

Candidate make_candidate(const cv::Vec3d& rotation, const cv::Vec3d& translation, const Correspondence& c,
                         const LensModel& lens) {
  cv::Matx33d r;
  cv::Rodrigues(rotation, r);
  Candidate out;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      out.camera_from_board[column][row] = r(row, column);
    out.camera_from_board[3][row] = translation[row];
  }
  double sum = 0;
  for (std::size_t i = 0; i < c.board.size(); ++i) {
    const glm::dvec4 p = out.camera_from_board * glm::dvec4(c.board[i].x, c.board[i].y, 0.0, 1.0);
    const std::optional<glm::dvec2> pixel = lens.project(glm::dvec3(p));
    if (!pixel || !(p.z > 0))
      return Candidate{};
    sum +=
        (pixel->x - c.pixel[i].x) * (pixel->x - c.pixel[i].x) + (pixel->y - c.pixel[i].y) * (pixel->y - c.pixel[i].y);
  }
  out.rms_px = std::sqrt(sum / static_cast<double>(c.board.size()));
  return out;
}

/// Both solutions of the planar problem (Collins & Bartoli, IJCV 2014), and that of the homography (Zhang 2000), which
/// holds where they do not: exactly face on. Each refined, the best first. The camera is ideal here: rays through the
/// lens model replace pixels, so that any lens model works.
std::vector<Candidate> solve_plane(const Correspondence& c, const LensModel& lens) {
  const cv::Matx33d ideal = cv::Matx33d::eye();
  std::vector<cv::Mat> rotations, translations;
  cv::solvePnPGeneric(c.board, c.ray, ideal, cv::noArray(), rotations, translations, false,
                      c.ids.size() == 1 ? cv::SOLVEPNP_IPPE_SQUARE : cv::SOLVEPNP_IPPE);
  cv::Mat homography_rotation, homography_translation;
  if (cv::solvePnP(c.board, c.ray, ideal, cv::noArray(), homography_rotation, homography_translation)) {
    rotations.push_back(homography_rotation);
    translations.push_back(homography_translation);
  }
  std::vector<Candidate> candidates;
  for (std::size_t i = 0; i < rotations.size(); ++i) {
    cv::Mat rotation = rotations[i].clone(), translation = translations[i].clone();
    cv::solvePnPRefineLM(c.board, c.ray, ideal, cv::noArray(), rotation, translation);
    candidates.push_back(
        make_candidate(cv::Vec3d(rotation.ptr<double>()), cv::Vec3d(translation.ptr<double>()), c, lens));
  }
  std::sort(candidates.begin(), candidates.end(),
            [](const Candidate& a, const Candidate& b) { return a.rms_px < b.rms_px; });
  return candidates;
}

/// From one pose to the other, radians: cos = (trace - 1) / 2.
double turned_by(const glm::dmat4& a, const glm::dmat4& b) {
  const glm::dmat3 r = glm::transpose(glm::dmat3(a)) * glm::dmat3(b);
  return std::acos(std::clamp(0.5 * (r[0][0] + r[1][1] + r[2][2] - 1.0), -1.0, 1.0));
}

/// Both solutions may be refined to the same pose: then there is no other.
double second_rms(const std::vector<Candidate>& candidates) {
  for (std::size_t k = 1; k < candidates.size(); ++k)
    if (turned_by(candidates[0].camera_from_board, candidates[k].camera_from_board) > kSamePose)
      return candidates[k].rms_px;
  return std::numeric_limits<double>::infinity();
}

std::optional<Error> check_board(const BoardLayout& board) {
  if (board.markers.empty())
    return Error{ErrorCode::value_invalid, "no marker id is given", "[marker] ids", "list the ids of the markers used"};
  for (const PlacedMarker& m : board.markers)
    if (!(m.side_m > 0 && m.side_m < 100))
      return Error{ErrorCode::value_invalid, "the side of a marker is not between 0 and 100 metres", "[marker] size_m",
                   "give the outer side of the black square in metres"};
  return std::nullopt;
}

Error no_marker(const BoardLayout& board, const std::vector<SeenMarker>& seen) {
  std::vector<int> wanted, found;
  for (const PlacedMarker& m : board.markers)
    wanted.push_back(m.id);
  for (const SeenMarker& m : seen)
    found.push_back(m.id);
  return {ErrorCode::not_found,
          "no marker of the board is in the picture: looked for " + board.dictionary + " ids " + list_ids(wanted) +
              ", seen " + list_ids(found),
          "picture",
          seen.empty() ? "check the dictionary; the whole black square and a white margin must be visible and sharp"
                       : "check [marker] ids"};
}

} // namespace

/// Corners are found to kCornerNoise_px: two fits that are better than that are equally good.
bool MarkerPose::tilt_uncertain() const {
  return second_rms_px < kEquallyGood * std::max(reprojection_rms_px, kCornerNoise_px);
}

BoardLayout BoardLayout::single(const std::string& dictionary, int id, double side_m) {
  return {dictionary, {{id, side_m, {0.0, 0.0}}}};
}

Result<BoardLayout> BoardLayout::grid(const std::string& dictionary, const std::vector<int>& ids, int columns,
                                      double side_m, double gap_m) {
  if (columns < 1 || ids.empty() || ids.size() % static_cast<std::size_t>(columns) != 0 || !(gap_m >= 0))
    return Error{ErrorCode::value_invalid, "the ids do not fill whole rows of the board", "[marker]",
                 "give columns x rows ids"};
  const int rows = static_cast<int>(ids.size()) / columns;
  const double pitch = side_m + gap_m;
  BoardLayout board{dictionary, {}};
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column)
      board.markers.push_back({ids[static_cast<std::size_t>(row * columns + column)],
                               side_m,
                               {(column - 0.5 * (columns - 1)) * pitch, (0.5 * (rows - 1) - row) * pitch}});
  return board;
}

std::array<glm::dvec2, 4> board_corners(const PlacedMarker& marker) {
  const double h = 0.5 * marker.side_m;
  const glm::dvec2 c = marker.centre_m;
  return {c + glm::dvec2(-h, h), c + glm::dvec2(h, h), c + glm::dvec2(h, -h), c + glm::dvec2(-h, -h)};
}

Result<std::vector<SeenMarker>> find_markers(const Rgb8Image& picture, const std::string& dictionary) {
  const auto known = dictionary_named(dictionary);
  if (!known)
    return unknown_dictionary(dictionary);
  try {
    cv::Mat colour(picture.height, picture.width, CV_8UC3, const_cast<std::uint8_t*>(picture.bytes.data())), grey;
    cv::cvtColor(colour, grey, cv::COLOR_RGB2GRAY);
    const auto parameters = cv::aruco::DetectorParameters::create();
    parameters->cornerRefinementMethod = cv::aruco::CORNER_REFINE_SUBPIX;
    std::vector<std::vector<cv::Point2f>> corners;
    std::vector<int> ids;
    cv::aruco::detectMarkers(grey, *known, corners, ids, parameters);
    std::vector<SeenMarker> seen(ids.size());
    for (std::size_t i = 0; i < ids.size(); ++i) {
      seen[i].id = ids[i];
      for (std::size_t k = 0; k < 4; ++k)
        seen[i].corner_px[(k + quarter_turns(dictionary)) % 4] = {static_cast<double>(corners[i][k].x),
                                                                  static_cast<double>(corners[i][k].y)};
    }
    const detail::GreyImage image = grey_image(picture);
    for (SeenMarker& marker : seen)
      detail::fit_square_edges(image, marker.corner_px);
    std::sort(seen.begin(), seen.end(), [](const SeenMarker& a, const SeenMarker& b) { return a.id < b.id; });
    return seen;
  } catch (const cv::Exception& error) {
    return Error{ErrorCode::value_invalid, std::string("the marker search failed (") + error.err + ")", "picture", ""};
  }
}

Result<MarkerPose> marker_pose(const std::vector<SeenMarker>& seen, const LensModel& lens, const BoardLayout& board,
                               const glm::dmat4& world_from_board) {
  if (auto error = check_board(board))
    return *error;
  const Correspondence c = match(seen, lens, board);
  if (c.ids.empty())
    return no_marker(board, seen);
  try {
    const std::vector<Candidate> candidates = solve_plane(c, lens);
    if (candidates.empty() || !std::isfinite(candidates[0].rms_px))
      return Error{ErrorCode::not_found, "the marker corners fit no camera position", "picture",
                   "check the lens file and [marker] size_m"};
    MarkerPose pose;
    pose.world_from_camera = world_from_board * glm::inverse(candidates[0].camera_from_board);
    pose.reprojection_rms_px = candidates[0].rms_px;
    pose.second_rms_px = second_rms(candidates);
    pose.seen = seen;
    pose.ids_used = c.ids;
    return pose;
  } catch (const cv::Exception& error) {
    return Error{ErrorCode::not_found, std::string("the marker corners fit no camera position (") + error.err + ")",
                 "picture", "check the lens file"};
  }
}

Result<MarkerPose> marker_pose(const Rgb8Image& picture, const LensModel& lens, const BoardLayout& board,
                               const glm::dmat4& world_from_board, const std::string& picture_name) {
  if ((lens.width_px && lens.width_px != picture.width) || (lens.height_px && lens.height_px != picture.height))
    return Error{ErrorCode::value_invalid,
                 "the picture is " + std::to_string(picture.width) + " x " + std::to_string(picture.height) +
                     " but the lens file is for " + std::to_string(lens.width_px) + " x " +
                     std::to_string(lens.height_px),
                 picture_name, "use the lens file of this camera mode"};
  const auto seen = find_markers(picture, board.dictionary);
  if (!seen)
    return seen.error();
  auto pose = marker_pose(*seen, lens, board, world_from_board);
  if (!pose) {
    Error error = pose.error();
    if (error.where == "picture")
      error.where = picture_name;
    return error;
  }
  return pose;
}

} // namespace daylit
