#pragma once

#include <cstdint>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include "runtime/base/render_camera.h"
#include "runtime/gl/scene_buffers.h"

namespace daylit {

/// What the room shows in every pixel, whatever stands before it: from the numbers of triangles that were drawn.
class RoomView {
public:
  /// Row 0 first, from 1; 0: no triangle. Filled by the renderer.
  std::vector<float> ids;

  void set(const RenderCamera& camera, const glm::dvec3& origin);
  int width() const { return width_; }
  int height() const { return height_; }
  int id(int x, int y) const { return static_cast<int>(ids[index(x, y)]); }
  /// Number of the room's plane that a pixel shows, from 1; 0: none.
  int plane_number(const RoomBuffers& room, int x, int y) const {
    const int shown = id(x, y);
    return shown > 0 ? room.plane_number(shown) : 0;
  }
  RoomSurface surface(const RoomBuffers& room, int x, int y) const {
    const int shown = id(x, y);
    if (shown <= 0)
      return {};
    const glm::vec4& plane = room.plane(shown);
    const glm::vec3 n(plane), ray = corner_ + static_cast<float>(x) * right_ + static_cast<float>(y) * down_;
    return {room.triangle(shown), eye_ - (height_of_eye(plane) / glm::dot(n, ray)) * ray};
  }
  /// Unit, towards the eye. The pixel shows a triangle.
  glm::vec3 normal(const RoomBuffers& room, int x, int y) const {
    const glm::vec4& plane = room.plane(id(x, y));
    return height_of_eye(plane) < 0.0f ? -glm::vec3(plane) : glm::vec3(plane);
  }

private:
  int width_ = 0, height_ = 0;
  glm::vec3 eye_{0.0f};                               ///< relative to the origin
  glm::vec3 corner_{0.0f}, right_{0.0f}, down_{0.0f}; ///< through pixel (x, y) goes corner + x right + y down

  float height_of_eye(const glm::vec4& plane) const { return glm::dot(glm::vec3(plane), eye_) + plane.w; }
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
  }
};

} // namespace daylit
