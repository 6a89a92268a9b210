// Markers of a board by the edges of their squares, from where a first pose puts them.

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "capture/markers/edge_corners.h"
#include "capture/markers/marker_pose.h"

namespace daylit {

namespace {

constexpr double kLeastSide_px = 6;      // of a square whose edges can be told from its cells
constexpr double kBorder_px = 6;         // what is looked at around a square
constexpr double kRoundEnough_px = 0.05; // a further round does not move the pose more than the corners' noise
constexpr double kFar_px = 1e9;
constexpr int kRounds = 3;

std::optional<SeenMarker> projected(const PlacedMarker& placed, const LensModel& lens,
                                    const glm::dmat4& camera_from_board, const Rgb8Image& picture) {
  SeenMarker marker{placed.id, {}};
  const std::array<glm::dvec2, 4> corners = board_corners(placed);
  for (std::size_t k = 0; k < 4; ++k) {
    const auto p = lens.project(glm::dvec3(camera_from_board * glm::dvec4(corners[k], 0.0, 1.0)));
    if (!p || p->x < kBorder_px || p->y < kBorder_px || p->x > picture.width - 1 - kBorder_px ||
        p->y > picture.height - 1 - kBorder_px)
      return std::nullopt;
    marker.corner_px[k] = *p;
  }
  for (std::size_t k = 0; k < 4; ++k)
    if (glm::length(marker.corner_px[k] - marker.corner_px[(k + 1) % 4]) < kLeastSide_px)
      return std::nullopt;
  return marker;
}

double largest_move(const std::vector<SeenMarker>& a, const std::vector<SeenMarker>& b) {
  if (a.size() != b.size())
    return kFar_px;
  double most = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t k = 0; k < 4; ++k)
      most = std::max(most, a[i].id == b[i].id ? glm::length(a[i].corner_px[k] - b[i].corner_px[k]) : kFar_px);
  return most;
}

std::vector<SeenMarker> fitted(const detail::GreyImage& light, const Rgb8Image& picture, const LensModel& lens,
                               const BoardLayout& board, const glm::dmat4& camera_from_board) {
  std::vector<SeenMarker> found;
  for (const PlacedMarker& placed : board.markers) {
    auto marker = projected(placed, lens, camera_from_board, picture);
    if (marker && detail::fit_square_edges(light, marker->corner_px) == 4)
      found.push_back(*marker);
  }
  return found;
}

} // namespace

std::vector<SeenMarker> find_on_board(const Rgb8Image& picture, const LensModel& lens, const BoardLayout& board,
                                      const glm::dmat4& camera_from_board, double exponent) {
  return fitted(detail::linear_grey(picture, exponent), picture, lens, board, camera_from_board);
}

namespace {

struct View {
  const detail::GreyImage& light;
  const Rgb8Image& picture;
  const LensModel& lens;
  const BoardLayout& board;
  const glm::dmat4& world_from_board;
};

/// Fits the squares where the pose puts them, solves again, until the corners stay.
MarkerPose settled(const View& v, MarkerPose pose, const glm::dmat4& start) {
  glm::dmat4 world_from_camera = start;
  std::vector<SeenMarker> before;
  for (int round = 0; round < kRounds; ++round) {
    const glm::dmat4 camera_from_board = glm::inverse(world_from_camera) * v.world_from_board;
    const std::vector<SeenMarker> again = fitted(v.light, v.picture, v.lens, v.board, camera_from_board);
    auto better = marker_pose(again, v.lens, v.board, v.world_from_board);
    if (!better || better->ids_used.size() < pose.ids_used.size())
      break;
    better->seen = pose.seen;
    pose = std::move(*better);
    world_from_camera = pose.world_from_camera;
    if (largest_move(before, again) < kRoundEnough_px)
      break;
    before = again;
  }
  return pose;
}

bool is_better(const MarkerPose& a, const MarkerPose& b) {
  return a.ids_used.size() != b.ids_used.size() ? a.ids_used.size() > b.ids_used.size()
                                                : a.reprojection_rms_px < b.reprojection_rms_px;
}

/// Fewer than half of the markers that the pose puts into the picture are there.
bool contradicts_board(const View& v, const MarkerPose& pose) {
  const glm::dmat4 camera_from_board = glm::inverse(pose.world_from_camera) * v.world_from_board;
  const auto expected = std::count_if(v.board.markers.begin(), v.board.markers.end(), [&](const PlacedMarker& m) {
    return projected(m, v.lens, camera_from_board, v.picture).has_value();
  });
  return 2 * pose.ids_used.size() < static_cast<std::size_t>(expected);
}

} // namespace

Result<MarkerPose> refined_marker_pose(const Rgb8Image& picture, const std::vector<SeenMarker>& seen,
                                       const LensModel& lens, const BoardLayout& board,
                                       const glm::dmat4& world_from_board, double exponent) {
  auto first = marker_pose(seen, lens, board, world_from_board);
  if (!first || board.markers.size() < 2)
    return first;
  const detail::GreyImage light = detail::linear_grey(picture, exponent);
  const View view{light, picture, lens, board, world_from_board};
  MarkerPose pose = settled(view, *first, first->world_from_camera);
  // Few or oblique markers allow two poses: the rest of the board decides.
  if (std::isfinite(first->second_rms_px) && pose.ids_used.size() < board.markers.size()) {
    MarkerPose other = settled(view, *first, first->second_world_from_camera);
    if (is_better(other, pose))
      pose = std::move(other);
  }
  if (contradicts_board(view, pose))
    return Error{ErrorCode::not_found,
                 "only " + std::to_string(pose.ids_used.size()) + " markers are where the pose puts the board",
                 "picture", "check the layout of the board; come nearer, or look at it less obliquely"};
  return pose;
}

} // namespace daylit
