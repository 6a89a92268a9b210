#include "calibration/fisheye_board.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/matrix.hpp>
#include <opencv2/core.hpp>

#include "calibration/code_picture.h"
#include "capture/markers/marker_pose.h"
#include "scene/core/parallel.h"

namespace daylit::calibration {

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kView_deg = 60.0, kApart_deg = 40.0;
constexpr double kFiner = 2.0; ///< pixels of a view for one of the lens: what is small is found, too
constexpr int kSmallest_px = 300, kLargest_px = 1600;
constexpr double kCornerNoise_px = 0.1 * kFiner;

/// A pinhole view out of a picture; camera_from_view turns its axes (x right, y down, z forward).
struct PinholeView {
  LensModel lens;
  glm::dmat3 camera_from_view{1.0};
};

PinholeView view_towards(const glm::dvec3& direction, double field_deg, const LensModel& lens) {
  const double per_radian = std::max(lens.fx, lens.fy) * kFiner;
  const int size =
      std::clamp(static_cast<int>(2 * per_radian * std::tan(0.5 * field_deg * kDegree)), kSmallest_px, kLargest_px);
  PinholeView view;
  view.lens = ideal_pinhole(size, size, field_deg * kDegree);
  const glm::dvec3 z = glm::normalize(direction);
  const glm::dvec3 x = glm::normalize(glm::cross(std::abs(z.y) < 0.9 ? glm::dvec3(0, 1, 0) : glm::dvec3(0, 0, 1), z));
  view.camera_from_view = {x, glm::cross(z, x), z};
  return view;
}

Rgb bilinear(const RgbImage& picture, const glm::dvec2& at) {
  const double x = std::clamp(at.x, 0.0, picture.width - 1.0), y = std::clamp(at.y, 0.0, picture.height - 1.0);
  const int i = std::min(static_cast<int>(x), std::max(picture.width - 2, 0));
  const int j = std::min(static_cast<int>(y), std::max(picture.height - 2, 0));
  const int i1 = std::min(i + 1, picture.width - 1), j1 = std::min(j + 1, picture.height - 1);
  const auto u = static_cast<float>(x - i), v = static_cast<float>(y - j);
  return (1 - v) * ((1 - u) * picture.at(i, j) + u * picture.at(i1, j)) +
         v * ((1 - u) * picture.at(i, j1) + u * picture.at(i1, j1));
}

/// Exposed so that its 95th percentile is white.
Rgb8Image picture_of(const PinholeView& view, const RgbImage& radiance, const LensModel& lens) {
  RgbImage out(view.lens.width_px, view.lens.height_px);
  parallel_for(0, out.height, [&](int y) {
    for (int x = 0; x < out.width; ++x)
      if (const auto d = view.lens.unproject({x, y}))
        if (const auto px = lens.project(view.camera_from_view * *d))
          if (px->x > -0.5 && px->y > -0.5 && px->x < radiance.width - 0.5 && px->y < radiance.height - 0.5)
            out.at(x, y) = bilinear(radiance, *px);
  });
  std::vector<float> light;
  for (const Rgb& texel : out.texels)
    light.push_back(luminance(texel));
  std::ranges::sort(light);
  const float white = std::max(light[light.size() * 95 / 100], 1e-20f);
  for (Rgb& texel : out.texels)
    texel = glm::clamp(texel / white, 0.0f, 1.0f);
  return view_of(out, true);
}

/// Directions over the field of the lens, kApart_deg from each other: rings around the axis.
std::vector<glm::dvec3> directions_of(const LensModel& lens) {
  std::vector<glm::dvec3> out{{0, 0, 1}};
  for (double theta = kApart_deg * kDegree; theta < lens.max_theta; theta += kApart_deg * kDegree) {
    const int count = static_cast<int>(std::ceil(2 * std::numbers::pi * std::sin(theta) / (kApart_deg * kDegree)));
    for (int k = 0; k < count; ++k) {
      const double phi = 2 * std::numbers::pi * k / count;
      out.emplace_back(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
    }
  }
  return out;
}

bool on_board(const BoardLayout& board, int id) {
  return std::ranges::any_of(board.markers, [&](const PlacedMarker& m) { return m.id == id; });
}

/// Middle of the markers of the board that any view shows, camera frame, and the angle that holds them all.
struct Whereabouts {
  glm::dvec3 middle{0.0};
  double radius = 0;
};

Result<Whereabouts> look_around(const RgbImage& radiance, const LensModel& lens, const BoardLayout& board) {
  std::set<int> other;
  std::vector<glm::dvec3> corners;
  for (const glm::dvec3& direction : directions_of(lens)) {
    const PinholeView view = view_towards(direction, kView_deg, lens);
    const auto seen = find_markers(picture_of(view, radiance, lens), board.dictionary);
    if (!seen)
      return seen.error();
    for (const SeenMarker& m : *seen)
      if (on_board(board, m.id)) {
        for (const glm::dvec2& px : m.corner_px)
          if (const auto d = view.lens.unproject(px))
            corners.push_back(view.camera_from_view * *d);
      } else {
        other.insert(m.id);
      }
  }
  if (corners.empty())
    return Error{ErrorCode::not_found,
                 other.empty() ? "no marker is seen"
                               : fmt::format("{} other markers are seen, none of the board", other.size()),
                 "the board", "is it in the picture, sharp, lit, and [marker] right?"};
  Whereabouts out;
  for (const glm::dvec3& d : corners)
    out.middle += d;
  out.middle = glm::normalize(out.middle);
  for (const glm::dvec3& d : corners)
    out.radius = std::max(out.radius, std::acos(std::clamp(glm::dot(d, out.middle), -1.0, 1.0)));
  return out;
}

/// Pixels of the corners in the view for the camera moved by small turns (about the camera's axes) and shifts.
std::vector<glm::dvec2> pixels_of(const std::vector<glm::dvec3>& world, const glm::dmat4& world_from_view,
                                  const std::array<double, 6>& by, const LensModel& lens) {
  const glm::dvec3 turn(by[0], by[1], by[2]);
  const double angle = glm::length(turn);
  const glm::dmat3 rotation =
      glm::dmat3(world_from_view) * (angle > 0 ? glm::mat3_cast(glm::angleAxis(angle, turn / angle)) : glm::dmat3(1.0));
  const glm::dvec3 eye = glm::dvec3(world_from_view[3]) + glm::dvec3(by[3], by[4], by[5]);
  std::vector<glm::dvec2> out;
  for (const glm::dvec3& p : world)
    out.push_back(lens.project(glm::transpose(rotation) * (p - eye)).value_or(glm::dvec2(0.0)));
  return out;
}

/// Covariance s^2 (J^T J)^-1 of turn and position, s the noise of a corner; its worst axes.
void add_uncertainty(const glm::dmat4& world_from_view, const LensModel& lens, LocatedBoard& found) {
  constexpr double kStep = 1e-5;
  const auto base = pixels_of(found.corner_world, world_from_view, {}, lens);
  cv::Mat1d j(static_cast<int>(2 * base.size()), 6);
  for (int k = 0; k < 6; ++k) {
    std::array<double, 6> by{};
    by[static_cast<std::size_t>(k)] = kStep;
    const auto moved = pixels_of(found.corner_world, world_from_view, by, lens);
    for (std::size_t i = 0; i < base.size(); ++i) {
      const glm::dvec2 d = (moved[i] - base[i]) / kStep;
      j(static_cast<int>(2 * i), k) = d.x, j(static_cast<int>(2 * i + 1), k) = d.y;
    }
  }
  cv::Mat covariance;
  cv::invert(cv::Mat(j.t() * j), covariance, cv::DECOMP_SVD);
  const double noise = std::max(found.rms_px, kCornerNoise_px);
  const auto worst = [&](int first) {
    cv::Mat1d values;
    cv::eigen(covariance(cv::Rect(first, first, 3, 3)).clone(), values);
    return noise * std::sqrt(std::max(values(0), 0.0));
  };
  found.sigma_deg = worst(0) / kDegree;
  found.sigma_m = worst(3);
}

} // namespace

Result<LocatedBoard> locate_board(const RgbImage& radiance, const LensModel& lens, const BoardLayout& board,
                                  const glm::dmat4& world_from_board) {
  const auto where = look_around(radiance, lens, board);
  if (!where)
    return where.error();
  const double field = std::clamp(2.6 * where->radius / kDegree, 30.0, 110.0);
  const PinholeView view = view_towards(where->middle, field, lens);
  const auto pose = marker_pose(picture_of(view, radiance, lens), view.lens, board, world_from_board, "the board");
  if (!pose)
    return pose.error();
  LocatedBoard found;
  found.world_from_camera = pose->world_from_camera * glm::dmat4(glm::transpose(view.camera_from_view));
  found.ids = pose->ids_used;
  found.rms_px = pose->reprojection_rms_px;
  found.tilt_uncertain = pose->tilt_uncertain();
  for (const SeenMarker& m : pose->seen)
    for (const PlacedMarker& placed : board.markers)
      if (placed.id == m.id && std::ranges::find(found.ids, m.id) != found.ids.end()) {
        const auto corners = board_corners(placed);
        for (std::size_t k = 0; k < 4; ++k)
          if (const auto d = view.lens.unproject(m.corner_px[k])) {
            found.corner_camera.push_back(view.camera_from_view * *d);
            found.corner_world.emplace_back(world_from_board * glm::dvec4(corners[k], 0.0, 1.0));
          }
      }
  add_uncertainty(pose->world_from_camera, view.lens, found);
  return found;
}

} // namespace daylit::calibration
