#include "runtime/base/render_camera.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

namespace daylit {

namespace {

constexpr double kLargestTangent = 5.671; // tan 80 degrees
constexpr float kOutside = -1e9f;

bool is_rigid(const glm::dmat4& m) {
  const glm::dmat3 r(m);
  const glm::dmat3 product = glm::transpose(r) * r;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      if (!(std::fabs(product[i][j] - (i == j ? 1.0 : 0.0)) < 1e-4))
        return false;
  return glm::determinant(r) > 0.0 && std::isfinite(m[3].x) && std::isfinite(m[3].y) && std::isfinite(m[3].z);
}

bool is_undistorted(const LensModel& lens) {
  return lens.kind == LensKind::pinhole &&
         std::all_of(lens.distortion.begin(), lens.distortion.end(), [](double d) { return d == 0.0; });
}

/// Widens the drawn picture until it holds every position, and shifts the positions accordingly.
void fit_to_positions(RenderCamera& camera) {
  double left = 0, top = 0, right = camera.width_px - 1, bottom = camera.height_px - 1;
  for (const glm::vec2& p : camera.drawn_position) {
    if (p.x == kOutside)
      continue;
    left = std::min(left, static_cast<double>(p.x));
    right = std::max(right, static_cast<double>(p.x));
    top = std::min(top, static_cast<double>(p.y));
    bottom = std::max(bottom, static_cast<double>(p.y));
  }
  const double shift_x = std::ceil(-left), shift_y = std::ceil(-top);
  camera.width_px = static_cast<int>(std::ceil(right) + shift_x) + 1;
  camera.height_px = static_cast<int>(std::ceil(bottom) + shift_y) + 1;
  camera.cx += shift_x;
  camera.cy += shift_y;
  for (glm::vec2& p : camera.drawn_position)
    if (p.x != kOutside)
      p += glm::vec2(shift_x, shift_y);
}

/// Of the photograph's pixels; false when one is too far from the axis. `sx`, `sy`: size of the photograph over that of
/// the calibration.
bool find_drawn_positions(const LensModel& lens, double sx, double sy, RenderCamera& camera) {
  camera.drawn_position.reserve(static_cast<std::size_t>(camera.photo_width_px) * camera.photo_height_px);
  for (int y = 0; y < camera.photo_height_px; ++y)
    for (int x = 0; x < camera.photo_width_px; ++x) {
      const auto d = lens.unproject({(x + 0.5) / sx - 0.5, (y + 0.5) / sy - 0.5});
      if (!d) {
        camera.drawn_position.emplace_back(kOutside, kOutside);
        continue;
      }
      if (d->z <= 0.0 || std::hypot(d->x, d->y) > kLargestTangent * d->z)
        return false;
      camera.drawn_position.emplace_back(camera.fx * d->x / d->z + camera.cx, camera.fy * d->y / d->z + camera.cy);
    }
  return true;
}

} // namespace

glm::dvec3 PinholeCamera::direction(const glm::dvec2& pixel) const {
  const glm::dvec3 d((pixel.x - cx) / fx, (pixel.y - cy) / fy, 1.0);
  return glm::normalize(glm::dmat3(world_from_camera) * d);
}

glm::mat4 PinholeCamera::clip_from_scene(const glm::dvec3& origin) const {
  glm::dmat4 projection(0.0); // columns: camera x, y, z, 1
  projection[0][0] = 2.0 * fx / width_px;
  projection[1][1] = 2.0 * fy / height_px;
  projection[2] = {2.0 * (cx + 0.5) / width_px - 1.0, 2.0 * (cy + 0.5) / height_px - 1.0, 0.0, 1.0};
  projection[3] = {0.0, 0.0, kNearPlane_m, 0.0};
  glm::dmat4 world_from_scene(1.0);
  world_from_scene[3] = glm::dvec4(origin, 1.0);
  return glm::mat4(projection * glm::inverse(world_from_camera) * world_from_scene);
}

PixelRays::PixelRays(const PinholeCamera& camera, const glm::dvec3& origin) {
  const glm::dmat3 axes(camera.world_from_camera);
  const glm::dvec3 per_x = axes[0] / camera.fx, per_y = axes[1] / camera.fy;
  eye = glm::vec3(camera.eye() - origin);
  corner = glm::vec3(axes[2] - camera.cx * per_x - camera.cy * per_y);
  right = glm::vec3(per_x);
  down = glm::vec3(per_y);
}

Result<RenderCamera> make_render_camera(const LensModel& lens, const glm::dmat4& world_from_camera, int width_px,
                                        int height_px) {
  if (!is_rigid(world_from_camera))
    return Error{ErrorCode::value_invalid, "the camera pose is not a rotation and a translation", "world_from_camera",
                 "give a 4 x 4 matrix with orthonormal axes and determinant 1"};
  if (width_px <= 0 || height_px <= 0 || !(lens.fx > 0.0) || !(lens.fy > 0.0))
    return Error{ErrorCode::value_invalid, "the interior camera has no size or focal length", "interior lens", ""};
  // A lens file may leave the size out: it is for the photograph as it is.
  const double sx = lens.width_px > 0 ? static_cast<double>(width_px) / lens.width_px : 1.0;
  const double sy = lens.height_px > 0 ? static_cast<double>(height_px) / lens.height_px : 1.0;
  if (std::fabs(sx / sy - 1.0) > 0.01)
    return Error{ErrorCode::value_invalid,
                 "the photograph is " + std::to_string(width_px) + " x " + std::to_string(height_px) +
                     ", the calibration " + std::to_string(lens.width_px) + " x " + std::to_string(lens.height_px),
                 "interior lens",
                 "the aspect ratios differ: calibrate at the size of the photograph, or do not crop it"};
  RenderCamera camera;
  camera.width_px = camera.photo_width_px = width_px;
  camera.height_px = camera.photo_height_px = height_px;
  camera.fx = lens.fx * sx;
  camera.fy = lens.fy * sy;
  camera.cx = (lens.cx + 0.5) * sx - 0.5;
  camera.cy = (lens.cy + 0.5) * sy - 0.5;
  camera.world_from_camera = world_from_camera;
  if (is_undistorted(lens))
    return camera;
  if (!find_drawn_positions(lens, sx, sy, camera))
    return Error{ErrorCode::value_invalid, "the interior lens sees more than 160 degrees", "interior lens",
                 "crop the picture: one perspective picture cannot hold that field"};
  fit_to_positions(camera);
  return camera;
}

} // namespace daylit
