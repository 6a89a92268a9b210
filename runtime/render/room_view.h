#pragma once

#include <cstdint>
#include <vector>

#include <glm/vec3.hpp>

#include "runtime/render/render_camera.h"
#include "runtime/render/scene_buffers.h"

namespace daylit {

/// What the room shows in every pixel, whatever stands before it: from the numbers of triangles that were drawn.
class RoomView {
public:
  /// Row 0 first, from 1; 0: no triangle. Filled by the renderer.
  std::vector<float> ids;

  void set(const RenderCamera& camera, const glm::dvec3& origin) {
    camera_ = camera;
    origin_ = origin;
  }
  int width() const { return camera_.width_px; }
  int height() const { return camera_.height_px; }
  int id(int x, int y) const { return static_cast<int>(ids[index(x, y)]); }
  /// Number of the room's plane that a pixel shows, from 1; 0: none.
  int plane_number(const RoomBuffers& room, int x, int y) const {
    const int shown = id(x, y);
    return shown > 0 ? room.plane_number(shown) : 0;
  }
  RoomSurface surface(const RoomBuffers& room, int x, int y) const;
  /// Unit, towards the eye. The pixel shows a triangle.
  glm::vec3 normal(const RoomBuffers& room, int x, int y) const;

private:
  RenderCamera camera_;
  glm::dvec3 origin_{0.0};

  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(camera_.width_px) + static_cast<std::size_t>(x);
  }
};

} // namespace daylit
