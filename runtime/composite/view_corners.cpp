#include "runtime/composite/view_corners.h"

#include <algorithm>
#include <limits>

#include "scene/core/parallel.h"

namespace daylit {

ViewCorners::ViewCorners(const RenderCamera& camera, const RayScene& room_rays, const PictureRenderer* renderer,
                         const glm::dvec3& origin)
    : camera_(&camera), rays_(&room_rays), renderer_(renderer), origin_(origin),
      columns_((camera.photo_width_px + kBlock - 1) / kBlock), rows_((camera.photo_height_px + kBlock - 1) / kBlock),
      corners_(static_cast<std::size_t>(columns_ + 1) * (rows_ + 1)) {
  parallel_for(0, rows_ + 1, [&](int row) {
    for (int column = 0; column <= columns_; ++column)
      corners_[index(column, row)] = look(std::min(column * kBlock, camera.photo_width_px - 1),
                                          std::min(row * kBlock, camera.photo_height_px - 1));
  });
}

ViewPoint ViewCorners::look(int x, int y) const {
  ViewPoint point;
  glm::dvec2 drawn(x, y);
  if (distorted()) {
    drawn = glm::dvec2(
        camera_->drawn_position[static_cast<std::size_t>(y) * camera_->photo_width_px + static_cast<std::size_t>(x)]);
    if (drawn.x < -1e8)
      return point;
  }
  point.direction = camera_->direction(drawn);
  if (RoomSurface known; !distorted() && renderer_ && renderer_->room_point(x, y, known)) {
    point.seen = known.triangle != RoomSurface{}.triangle;
    point.triangle = known.triangle;
    point.position = origin_ + glm::dvec3(known.position);
    return point;
  }
  RayHit hit;
  point.seen = rays_->closest(rays_->to_local(camera_->eye()), glm::vec3(point.direction), 0.0f,
                              std::numeric_limits<float>::infinity(), hit);
  point.triangle = hit.triangle;
  point.position = camera_->eye() + static_cast<double>(hit.distance) * point.direction;
  return point;
}

} // namespace daylit
