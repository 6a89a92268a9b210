#pragma once

// The room as a camera sees it at the corners of blocks of pixels: what light that changes slowly is looked up for.

#include <cstdint>
#include <vector>

#include "runtime/base/render_camera.h"
#include "runtime/picture/picture_renderer.h"
#include "scene/room/ray_scene.h"

namespace daylit {

/// The point of the room in a pixel.
struct ViewPoint {
  bool seen = false; ///< false: the pixel shows no surface
  std::uint32_t triangle = 0;
  glm::dvec3 position{0.0}, direction{0.0}; ///< world; of the ray from the camera
};

/// Pixels are the photograph's. Keeps references to everything given.
class ViewCorners {
public:
  static constexpr int kBlock = 8; ///< pixels on a side of a block

  ViewCorners() = default;
  /// `renderer`: may know what its pixels, relative to `origin`, show of the room; else rays are cast. May be null.
  ViewCorners(const RenderCamera& camera, const RayScene& room_rays, const PictureRenderer* renderer,
              const glm::dvec3& origin);

  /// Through any pixel.
  ViewPoint look(int x, int y) const;
  int columns() const { return columns_; } ///< of blocks; corners are one more each way
  int rows() const { return rows_; }
  std::size_t index(int column, int row) const { return static_cast<std::size_t>(row) * (columns_ + 1) + column; }
  /// By index.
  const std::vector<ViewPoint>& corners() const { return corners_; }
  bool distorted() const { return !camera_->drawn_position.empty(); }

private:
  const RenderCamera* camera_ = nullptr;
  const RayScene* rays_ = nullptr;
  const PictureRenderer* renderer_ = nullptr;
  glm::dvec3 origin_{0.0}; ///< of the renderer's points
  int columns_ = 0, rows_ = 0;
  std::vector<ViewPoint> corners_;
};

} // namespace daylit
