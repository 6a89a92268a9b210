#include "runtime/window/view_control.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

#include "scene/config/config.h"

namespace daylit {

namespace {
constexpr double kRadiansPerPixel = 0.006;
constexpr double kMostElevation = 1.5; // short of the pole
constexpr double kNearest_m = 0.05, kFarthest_m = 100.0;
} // namespace

Orbit Orbit::about(const glm::dmat4& world_from_camera, const glm::dvec3& near) {
  const glm::dvec3 eye(world_from_camera[3]), forward(world_from_camera[2]);
  Orbit o;
  o.distance_m = std::clamp(glm::dot(near - eye, forward), kNearest_m, kFarthest_m);
  o.target = eye + o.distance_m * forward;
  o.azimuth = std::atan2(-forward.y, -forward.x);
  o.elevation = std::clamp(std::asin(std::clamp(-forward.z, -1.0, 1.0)), -kMostElevation, kMostElevation);
  return o;
}

void Orbit::turn(const glm::dvec2& by_px) {
  azimuth -= kRadiansPerPixel * by_px.x;
  elevation = std::clamp(elevation + kRadiansPerPixel * by_px.y, -kMostElevation, kMostElevation);
}

void Orbit::zoom(double steps) { distance_m = std::clamp(distance_m * std::pow(0.9, steps), kNearest_m, kFarthest_m); }

glm::dmat4 Orbit::pose() const {
  const glm::dvec3 away(std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                        std::sin(elevation));
  return look_at(target + distance_m * away, target);
}

std::optional<glm::dvec3> on_floor(const glm::dvec3& eye, const glm::dvec3& direction, double height_m) {
  const double t = (height_m - eye.z) / direction.z;
  if (!(t > 0.0) || !(t <= kFarthest_m))
    return std::nullopt;
  return eye + t * direction;
}

glm::dvec3 ViewControl::direction(const glm::dvec2& pixel, const RenderCamera& camera) {
  glm::dvec2 drawn = pixel;
  if (!camera.drawn_position.empty()) {
    const int x = std::clamp(static_cast<int>(std::lround(pixel.x)), 0, camera.photo_width_px - 1),
              y = std::clamp(static_cast<int>(std::lround(pixel.y)), 0, camera.photo_height_px - 1);
    drawn = glm::dvec2(camera.drawn_position[static_cast<std::size_t>(y) * camera.photo_width_px + x]);
  }
  return camera.direction(drawn);
}

void ViewControl::press(const glm::dvec2& pixel, const RenderCamera& camera, std::optional<std::size_t> object,
                        const glm::dvec3& target) {
  last_ = pixel;
  target_ = target;
  held_ = object;
  turning_ = !held_;
  if (!held_)
    return;
  const auto point = on_floor(camera.eye(), direction(pixel, camera), positions_[*held_].z);
  if (point)
    grip_ = positions_[*held_] - *point;
  else
    held_.reset(); // seen from below or along the floor: there is nothing to drag over
}

void ViewControl::move(const glm::dvec2& pixel, const RenderCamera& camera) {
  const glm::dvec2 by = pixel - last_;
  last_ = pixel;
  if (held_) {
    if (const auto point = on_floor(camera.eye(), direction(pixel, camera), positions_[*held_].z))
      positions_[*held_] = *point + grip_;
  } else if (turning_) {
    if (!orbit_)
      orbit_ = Orbit::about(camera.world_from_camera, target_);
    orbit_->turn(by);
  }
}

void ViewControl::scroll(double steps, const RenderCamera& camera) {
  if (!orbit_)
    orbit_ = Orbit::about(camera.world_from_camera, target_);
  orbit_->zoom(steps);
}

void ViewControl::place(std::size_t k, const glm::dvec3& position) {
  if (held_ != k)
    positions_[k] = position;
}

void ViewControl::key(char which) {
  if (which == '1')
    parts_.direct = !parts_.direct;
  if (which == '2')
    parts_.indirect = !parts_.indirect;
  if (which == '3')
    parts_.differential = !parts_.differential;
  if (which == 'g')
    frame_times_ = !frame_times_;
  if (which == 'r')
    orbit_.reset();
  if (which == 's')
    save_ = true;
}

} // namespace daylit
