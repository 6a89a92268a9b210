#include "runtime/gl/room_view.h"

namespace daylit {

void RoomView::set(const RenderCamera& camera, const glm::dvec3& origin) {
  const glm::dmat3 axes(camera.world_from_camera);
  const glm::dvec3 right = axes[0] / camera.fx, down = axes[1] / camera.fy;
  width_ = camera.width_px;
  height_ = camera.height_px;
  eye_ = glm::vec3(camera.eye() - origin);
  corner_ = glm::vec3(axes[2] - camera.cx * right - camera.cy * down);
  right_ = glm::vec3(right);
  down_ = glm::vec3(down);
}

} // namespace daylit
