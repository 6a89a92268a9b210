#include "runtime/depth/real_things.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "scene/core/parallel.h"

namespace daylit {

namespace {

constexpr double kModelOff_m = 0.03; // a room measured with a tape, and the pose of the camera
constexpr int kFewestBeside = 3;     // of the eight pixels around show the thing too; fewer are noise
constexpr int kWidestFit_px = 12;    // of a normal, to each side
constexpr double kStep_m = 0.05;     // a larger one in depth, beside the noise, is the edge of a thing

/// The measured depth of each pixel of the drawn picture.
class DrawnDepth {
public:
  DrawnDepth(const DepthPicture& depth, const RenderCamera& camera, const LensModel& lens)
      : depth_(depth), camera_(camera), lens_(lens), fraction_(camera.photo_width_px / depth.width),
        scale_x_(lens.width_px > 0 ? static_cast<double>(camera.photo_width_px) / lens.width_px : 1.0),
        scale_y_(lens.height_px > 0 ? static_cast<double>(camera.photo_height_px) / lens.height_px : 1.0) {}

  float at(int x, int y) const {
    glm::ivec2 photo(x, y);
    if (!camera_.drawn_position.empty()) {
      const auto p = lens_.project({(x - camera_.cx) / camera_.fx, (y - camera_.cy) / camera_.fy, 1.0});
      if (!p)
        return 0.0f;
      photo = {static_cast<int>(std::floor((p->x + 0.5) * scale_x_)),
               static_cast<int>(std::floor((p->y + 0.5) * scale_y_))};
    }
    const glm::ivec2 pixel(photo.x / fraction_, photo.y / fraction_);
    if (photo.x < 0 || photo.y < 0 || pixel.x >= depth_.width || pixel.y >= depth_.height)
      return 0.0f;
    return depth_.at(pixel.x, pixel.y);
  }

private:
  const DepthPicture& depth_;
  const RenderCamera& camera_;
  const LensModel& lens_;
  int fraction_;
  double scale_x_, scale_y_;
};

/// Sums of a plane fit: 1/z = a + b x + c y, exact for a plane.
struct PlaneSums {
  glm::dmat3 moments{0.0};
  glm::dvec3 values{0.0};
  int count = 0;
  void add(double x, double y, double inverse_z) {
    const glm::dvec3 v(1.0, x, y);
    for (int c = 0; c < 3; ++c)
      moments[c] += v[c] * v;
    values += inverse_z * v;
    ++count;
  }
};

} // namespace

void RealThings::find(const DepthPicture& depth, double noise_m, const RenderCamera& camera, const LensModel& lens,
                      const RayScene& room_rays, const PictureRenderer* renderer) {
  camera_ = camera;
  camera_from_world_ = glm::transpose(glm::dmat3(camera.world_from_camera));
  noise_m_ = noise_m;
  keep_nearer_than_room(depth, camera, lens, room_rays, renderer);
  drop_specks();
  find_inner();
  find_thickness();
}

void RealThings::keep_nearer_than_room(const DepthPicture& depth, const RenderCamera& camera, const LensModel& lens,
                                       const RayScene& room_rays, const PictureRenderer* renderer) {
  const DrawnDepth measured(depth, camera, lens);
  const glm::dvec3 eye = camera.eye(), axis(camera.world_from_camera[2]);
  z_.assign(static_cast<std::size_t>(camera_.width_px) * static_cast<std::size_t>(camera_.height_px), 0.0f);
  const auto room_z = [&](int x, int y) {
    if (RoomSurface known; renderer && renderer->room_point(x, y, known))
      return known.triangle == kUnknownTriangle ? std::numeric_limits<double>::infinity()
                                                : glm::dot(known.position - eye, axis);
    const glm::dvec3 direction = camera.direction(glm::dvec2(x, y));
    RayHit hit;
    return room_rays.closest(room_rays.to_local(eye), glm::vec3(direction), 0.0f,
                             std::numeric_limits<float>::infinity(), hit)
               ? static_cast<double>(hit.distance) * glm::dot(direction, axis)
               : std::numeric_limits<double>::infinity();
  };
  parallel_for(0, camera_.height_px, [&](int y) {
    for (int x = 0; x < camera_.width_px; ++x)
      if (const auto z = static_cast<double>(measured.at(x, y));
          z > 0.0 && z + tolerance_m(z) + kModelOff_m < room_z(x, y))
        z_[index(x, y)] = static_cast<float>(z);
  });
}

/// A pixel that stands alone is noise.
void RealThings::drop_specks() {
  const std::vector<float> all = z_;
  parallel_for(0, camera_.height_px, [&](int y) {
    for (int x = 0; x < camera_.width_px; ++x) {
      const float z = all[index(x, y)];
      if (z == 0.0f)
        continue;
      int beside = -1;
      for (int v = std::max(y - 1, 0); v <= std::min(y + 1, camera_.height_px - 1); ++v)
        for (int u = std::max(x - 1, 0); u <= std::min(x + 1, camera_.width_px - 1); ++u)
          beside += all[index(u, v)] > 0.0f;
      if (beside < kFewestBeside)
        z_[index(x, y)] = 0.0f;
    }
  });
}

void RealThings::find_inner() {
  inner_.assign(z_.size(), 0);
  tiles_.assign(tile_columns() * static_cast<std::size_t>((camera_.height_px + kTile - 1) / kTile), 0);
  low_ = glm::dvec3(std::numeric_limits<double>::infinity());
  high_ = -low_;
  pixels_ = 0;
  for (int y = 0; y < camera_.height_px; ++y)
    for (int x = 0; x < camera_.width_px; ++x) {
      if (z(x, y) == 0.0f)
        continue;
      ++pixels_;
      if (!is_surrounded(x, y))
        continue;
      inner_[index(x, y)] = 1;
      tiles_[static_cast<std::size_t>(y / kTile) * tile_columns() + static_cast<std::size_t>(x / kTile)] = 1;
      low_ = glm::min(low_, seen(x, y));
      high_ = glm::max(high_, seen(x, y));
    }
  any_ = pixels_ > 0;
}

/// By things, on all eight sides.
bool RealThings::is_surrounded(int x, int y) const {
  if (x == 0 || y == 0 || x + 1 == camera_.width_px || y + 1 == camera_.height_px)
    return false;
  for (int v = y - 1; v <= y + 1; ++v)
    for (int u = x - 1; u <= x + 1; ++u)
      if (z(u, v) == 0.0f)
        return false;
  return true;
}

/// Neighbours that show the same thing.
bool RealThings::belong_together(std::size_t a, std::size_t b) const {
  return z_[a] > 0.0f && z_[b] > 0.0f &&
         std::fabs(z_[a] - z_[b]) < static_cast<float>(tolerance_m(static_cast<double>(z_[a])) + kStep_m);
}

/// The shorter of the pixel's row and column in its thing.
void RealThings::find_thickness() {
  thickness_m_.assign(z_.size(), 0.0f);
  const auto along = [&](std::size_t first, std::size_t step, int count, double f, bool is_first) {
    for (int from = 0, to = 0; from < count; from = to) {
      for (to = from + 1; to < count && belong_together(first + step * (to - 1), first + step * to);)
        ++to;
      for (int k = from; k < to; ++k) {
        const std::size_t i = first + step * static_cast<std::size_t>(k);
        const float length_m = static_cast<float>((to - from) / f) * z_[i];
        thickness_m_[i] = is_first ? length_m : std::min(thickness_m_[i], length_m);
      }
    }
  };
  const auto width = static_cast<std::size_t>(camera_.width_px);
  for (int y = 0; y < camera_.height_px; ++y)
    along(static_cast<std::size_t>(y) * width, 1, camera_.width_px, camera_.fx, true);
  for (int x = 0; x < camera_.width_px; ++x)
    along(static_cast<std::size_t>(x), width, camera_.height_px, camera_.fy, false);
  thickest_m_ = z_.empty() ? 0.0 : static_cast<double>(std::ranges::max(thickness_m_));
}

/// What the pixel shows, in the camera's frame.
glm::dvec3 RealThings::seen(int x, int y) const {
  const auto depth = static_cast<double>(z(x, y));
  return {(x - camera_.cx) / camera_.fx * depth, (y - camera_.cy) / camera_.fy * depth, depth};
}

/// The normal is that of the plane through the pixels around: as many of them as bring its noise below a tenth of a
/// radian, and that lie about as near.
std::optional<ThingPoint> RealThings::point(int x, int y) const {
  if (z(x, y) == 0.0f)
    return std::nullopt;
  const glm::dvec3 here = seen(x, y);
  const double pitch_m = here.z / camera_.fx, deviation_m = noise_m_ * here.z * here.z;
  const int reach = std::clamp(static_cast<int>(std::ceil(8.0 * deviation_m / pitch_m)), 2, kWidestFit_px);
  const int step = std::max(reach / 3, 1);
  const double apart = tolerance_m(here.z) + 3.0 * reach * pitch_m;
  PlaneSums sums;
  for (int v = y - reach; v <= y + reach; v += step)
    for (int u = x - reach; u <= x + reach; u += step)
      if (u >= 0 && v >= 0 && u < camera_.width_px && v < camera_.height_px && z(u, v) > 0.0f &&
          std::fabs(static_cast<double>(z(u, v)) - here.z) < apart)
        sums.add(u - x, v - y, 1.0 / static_cast<double>(z(u, v)));
  glm::dvec3 n(0.0, 0.0, -1.0);
  if (sums.count >= 3 && std::fabs(glm::determinant(sums.moments)) > 1e-6) {
    const glm::dvec3 fit = glm::inverse(sums.moments) * sums.values; // n . P = 1 on the plane
    n = -glm::normalize(glm::dvec3(fit.y * camera_.fx, fit.z * camera_.fy,
                                   fit.x + fit.y * (camera_.cx - x) + fit.z * (camera_.cy - y)));
  }
  const glm::dmat3 world(camera_.world_from_camera);
  return ThingPoint{camera_.eye() + world * here, world * n};
}

bool RealThings::hide(const glm::dvec3& x) const {
  const glm::dvec3 p = to_camera(x);
  if (!(p.z > 0.0))
    return false;
  const double u = camera_.fx * p.x / p.z + camera_.cx + 0.5, v = camera_.fy * p.y / p.z + camera_.cy + 0.5;
  if (!(u >= 0.0 && v >= 0.0 && u < camera_.width_px && v < camera_.height_px))
    return false;
  const auto depth = static_cast<double>(z(static_cast<int>(u), static_cast<int>(v)));
  return depth > 0.0 && depth + tolerance_m(depth) < p.z;
}

} // namespace daylit
