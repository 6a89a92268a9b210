// Markers of a board by the edges of their squares, from where a first pose puts them.

#include <algorithm>
#include <array>
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

Result<MarkerPose> refined_marker_pose(const Rgb8Image& picture, const std::vector<SeenMarker>& seen,
                                       const LensModel& lens, const BoardLayout& board,
                                       const glm::dmat4& world_from_board, double exponent) {
  auto pose = marker_pose(seen, lens, board, world_from_board);
  if (!pose || board.markers.size() < 2)
    return pose;
  const detail::GreyImage light = detail::linear_grey(picture, exponent);
  std::vector<SeenMarker> before;
  for (int round = 0; round < kRounds; ++round) {
    const glm::dmat4 camera_from_board = glm::inverse(pose->world_from_camera) * world_from_board;
    const std::vector<SeenMarker> again = fitted(light, picture, lens, board, camera_from_board);
    auto better = marker_pose(again, lens, board, world_from_board);
    if (!better || better->ids_used.size() < pose->ids_used.size())
      break;
    better->seen = seen;
    pose = std::move(better);
    if (largest_move(before, again) < kRoundEnough_px)
      break;
    before = again;
  }
  return pose;
}

} // namespace daylit
