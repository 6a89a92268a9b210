#include "capture/markers/marker_pose.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <glm/matrix.hpp>
#include <glm/vec4.hpp>
#include <opencv2/calib3d.hpp>

#include "capture/markers/find_markers.h"

namespace daylit {

namespace {

constexpr double kSamePose = 0.02;                           // radians: as well as a small marker says its tilt
constexpr double kEquallyGood = 2.0;                         // ratio of the rms of two poses
constexpr double kCornerNoise_px = 0.05;                     // of find_markers()
constexpr double kMisplaced_px = 0.5, kMisplacedRatio = 0.7; // rms of all, and what is left of it without one marker

std::string list_ids(const std::vector<int>& ids) {
  std::string text;
  for (const int id : ids)
    text.append(text.empty() ? "" : " ").append(std::to_string(id));
  return text.empty() ? "none" : text;
}

/// Points on the board (metres) and the rays that see them (z = 1), one of each per marker corner.
struct Correspondence {
  std::vector<cv::Point3d> board;
  std::vector<cv::Point2d> ray;
  std::vector<glm::dvec2> pixel;
  std::vector<int> ids;
};

bool is_seen_twice(const std::vector<SeenMarker>& seen, int id) {
  return std::count_if(seen.begin(), seen.end(), [&](const SeenMarker& m) { return m.id == id; }) > 1;
}

Correspondence match(const std::vector<SeenMarker>& seen, const LensModel& lens, const BoardLayout& board) {
  Correspondence c;
  for (const PlacedMarker& placed : board.markers)
    for (const SeenMarker& marker : seen) {
      if (marker.id != placed.id || is_seen_twice(seen, marker.id))
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

/// Squared distance, square pixels, of corner i from where the pose puts it; infinite behind the camera.
double squared_error(const glm::dmat4& camera_from_board, const Correspondence& c, std::size_t i,
                     const LensModel& lens) {
  const glm::dvec4 p = camera_from_board * glm::dvec4(c.board[i].x, c.board[i].y, 0.0, 1.0);
  const std::optional<glm::dvec2> pixel = lens.project(glm::dvec3(p));
  if (!pixel || !(p.z > 0))
    return std::numeric_limits<double>::infinity();
  const glm::dvec2 d = *pixel - c.pixel[i];
  return d.x * d.x + d.y * d.y;
}

Candidate make_candidate(const cv::Mat& rotation, const cv::Mat& translation, const Correspondence& c,
                         const LensModel& lens) {
  cv::Matx33d r;
  cv::Rodrigues(cv::Vec3d(rotation.ptr<double>()), r);
  Candidate out;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      out.camera_from_board[column][row] = r(row, column);
    out.camera_from_board[3][row] = translation.at<double>(row);
  }
  double sum = 0;
  for (std::size_t i = 0; i < c.board.size(); ++i)
    sum += squared_error(out.camera_from_board, c, i, lens);
  out.rms_px = std::sqrt(sum / static_cast<double>(c.board.size()));
  return out;
}

struct PlaneSolutions {
  std::vector<Candidate> refined;                                 ///< the best first
  double second_rms_px = std::numeric_limits<double>::infinity(); ///< of the second closed-form solution as it is
};

/// Both solutions of the planar problem (Collins & Bartoli, IJCV 2014), and that of the homography (Zhang 2000), which
/// holds where they do not: exactly face on. Each refined. The camera is ideal here: rays through the lens model
/// replace pixels, so that any lens model works.
PlaneSolutions solve_plane(const Correspondence& c, const LensModel& lens) {
  const cv::Matx33d ideal = cv::Matx33d::eye();
  std::vector<cv::Mat> rotations, translations;
  cv::solvePnPGeneric(c.board, c.ray, ideal, cv::noArray(), rotations, translations, false,
                      c.ids.size() == 1 ? cv::SOLVEPNP_IPPE_SQUARE : cv::SOLVEPNP_IPPE);
  PlaneSolutions out;
  if (rotations.size() > 1)
    out.second_rms_px = make_candidate(rotations[1], translations[1], c, lens).rms_px;
  cv::Mat homography_rotation, homography_translation;
  if (cv::solvePnP(c.board, c.ray, ideal, cv::noArray(), homography_rotation, homography_translation)) {
    rotations.push_back(homography_rotation);
    translations.push_back(homography_translation);
  }
  for (std::size_t i = 0; i < rotations.size(); ++i) {
    cv::Mat rotation = rotations[i].clone(), translation = translations[i].clone();
    cv::solvePnPRefineLM(c.board, c.ray, ideal, cv::noArray(), rotation, translation);
    out.refined.push_back(make_candidate(rotation, translation, c, lens));
  }
  std::sort(out.refined.begin(), out.refined.end(),
            [](const Candidate& a, const Candidate& b) { return a.rms_px < b.rms_px; });
  return out;
}

Correspondence without_marker(const Correspondence& c, std::size_t marker) {
  Correspondence rest = c;
  const auto drop = [&](auto& list, std::size_t each) {
    const auto first = list.begin() + static_cast<std::ptrdiff_t>(each * marker);
    list.erase(first, first + static_cast<std::ptrdiff_t>(each));
  };
  drop(rest.board, 4), drop(rest.ray, 4), drop(rest.pixel, 4), drop(rest.ids, 1);
  return rest;
}

/// The marker without which the others fit far better; three are needed. Residuals of one fit to all do not tell: a
/// marker in the wrong place bends the pose until the others are off as well.
std::optional<std::size_t> misplaced_marker(const Correspondence& c, double rms_px, const LensModel& lens) {
  if (c.ids.size() < 3 || rms_px < kMisplaced_px)
    return std::nullopt;
  std::optional<std::size_t> worst;
  double least = kMisplacedRatio * rms_px;
  for (std::size_t k = 0; k < c.ids.size(); ++k) {
    const PlaneSolutions rest = solve_plane(without_marker(c, k), lens);
    if (rest.refined.empty() || !(rest.refined.front().rms_px < least))
      continue;
    least = rest.refined.front().rms_px;
    worst = k;
  }
  return worst;
}

/// From one pose to the other, radians: cos = (trace - 1) / 2.
double turned_by(const glm::dmat4& a, const glm::dmat4& b) {
  const glm::dmat3 r = glm::transpose(glm::dmat3(a)) * glm::dmat3(b);
  return std::acos(std::clamp(0.5 * (r[0][0] + r[1][1] + r[2][2] - 1.0), -1.0, 1.0));
}

/// Both solutions may be refined to the same pose: then there is no other.
const Candidate* second_candidate(const std::vector<Candidate>& candidates) {
  for (std::size_t k = 1; k < candidates.size(); ++k)
    if (turned_by(candidates[0].camera_from_board, candidates[k].camera_from_board) > kSamePose)
      return &candidates[k];
  return nullptr;
}

/// Over the error of the first, which a perfect picture makes zero: 0.01 px at least.
double ambiguity_of(const PlaneSolutions& solutions, double second_refined_px) {
  constexpr double kLeast_px = 0.01;
  const double second = std::isfinite(second_refined_px) ? second_refined_px : solutions.second_rms_px;
  return std::max(1.0, second / std::max(solutions.refined.front().rms_px, kLeast_px));
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

Result<MarkerPose> marker_pose(const std::vector<SeenMarker>& seen, const LensModel& lens, const BoardLayout& board,
                               const glm::dmat4& world_from_board) {
  if (auto error = check_board(board))
    return *error;
  Correspondence c = match(seen, lens, board);
  if (c.ids.empty())
    return no_marker(board, seen);
  try {
    PlaneSolutions solutions = solve_plane(c, lens);
    while (!solutions.refined.empty()) {
      const auto wrong = misplaced_marker(c, solutions.refined.front().rms_px, lens);
      if (!wrong)
        break;
      c = without_marker(c, *wrong);
      solutions = solve_plane(c, lens);
    }
    if (solutions.refined.empty() || !std::isfinite(solutions.refined.front().rms_px))
      return Error{ErrorCode::not_found, "the marker corners fit no camera position", "picture",
                   "check the lens file and [marker] size_m"};
    MarkerPose pose;
    pose.world_from_camera = world_from_board * glm::inverse(solutions.refined.front().camera_from_board);
    pose.reprojection_rms_px = solutions.refined.front().rms_px;
    const Candidate* second = second_candidate(solutions.refined);
    pose.second_rms_px = second ? second->rms_px : std::numeric_limits<double>::infinity();
    if (second)
      pose.second_world_from_camera = world_from_board * glm::inverse(second->camera_from_board);
    pose.ambiguity = ambiguity_of(solutions, pose.second_rms_px);
    pose.seen = seen;
    pose.ids_used = c.ids;
    return pose;
  } catch (const cv::Exception& error) {
    return Error{ErrorCode::not_found, std::string("the marker corners fit no camera position (") + error.err + ")",
                 "picture", "check the lens file"};
  }
}

Result<void> check_lens_size(const Rgb8Image& picture, const LensModel& lens, const std::string& picture_name) {
  if ((lens.width_px && lens.width_px != picture.width) || (lens.height_px && lens.height_px != picture.height))
    return Error{ErrorCode::value_invalid,
                 "the picture is " + std::to_string(picture.width) + " x " + std::to_string(picture.height) +
                     " but the lens file is for " + std::to_string(lens.width_px) + " x " +
                     std::to_string(lens.height_px),
                 picture_name, "use the lens file of this camera mode"};
  return {};
}

Result<MarkerPose> marker_pose(const Rgb8Image& picture, const LensModel& lens, const BoardLayout& board,
                               const glm::dmat4& world_from_board, const std::string& picture_name, double exponent) {
  if (const auto fits = check_lens_size(picture, lens, picture_name); !fits)
    return fits.error();
  const auto seen = find_markers(picture, board.dictionary, exponent);
  if (!seen)
    return seen.error();
  auto pose = refined_marker_pose(picture, *seen, lens, board, world_from_board, exponent);
  if (!pose) {
    Error error = pose.error();
    if (error.where == "picture")
      error.where = picture_name;
    return error;
  }
  return pose;
}

} // namespace daylit
