#include "runtime/render/room_view.h"

#include <glm/geometric.hpp>

namespace daylit {

RoomSurface RoomView::surface(const RoomBuffers& room, int x, int y) const {
  const int shown = id(x, y);
  if (shown <= 0)
    return {};
  const glm::vec4& plane = room.plane(shown);
  const glm::dvec3 eye = camera_.eye() - origin_, ray = camera_.direction({x, y}), n(plane);
  const double t = -(glm::dot(n, eye) + static_cast<double>(plane.w)) / glm::dot(n, ray);
  return {room.triangle(shown), glm::vec3(eye + t * ray)};
}

glm::vec3 RoomView::normal(const RoomBuffers& room, int x, int y) const {
  const glm::vec4& plane = room.plane(id(x, y));
  const glm::dvec3 n(plane);
  const double height = glm::dot(n, camera_.eye() - origin_) + static_cast<double>(plane.w);
  return height < 0.0 ? -glm::vec3(plane) : glm::vec3(plane);
}

} // namespace daylit
