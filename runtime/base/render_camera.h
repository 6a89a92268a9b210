#pragma once

// The pinhole that the renderer draws with, and where each pixel of the (possibly distorted) photograph lies in it.

#include <vector>

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "scene/core/result.h"
#include "scene/lens/lens.h"

namespace daylit {

/// What a renderer draws with. Camera frame: x right, y down, z forward. Pixel (0, 0) is the centre of the top left
/// pixel.
struct PinholeCamera {
  int width_px = 0, height_px = 0; ///< of the drawn picture: larger than the photograph where distortion needs it
  double fx = 0, fy = 0, cx = 0, cy = 0;
  glm::dmat4 world_from_camera{1.0};

  glm::dvec3 eye() const { return glm::dvec3(world_from_camera[3]); }
  /// World direction (unit) through a drawn pixel position.
  glm::dvec3 direction(const glm::dvec2& drawn_pixel) const;
  /// Clip coordinates of points relative to `origin` (world metres): reversed infinite depth, near plane 1 cm, image
  /// row 0 in framebuffer row 0.
  glm::mat4 clip_from_scene(const glm::dvec3& origin) const;
};

/// And where the photograph lies in it.
struct RenderCamera : PinholeCamera {
  int photo_width_px = 0, photo_height_px = 0;
  /// Drawn pixel position of each photograph pixel centre; empty when both are the same picture. A pixel that the lens
  /// model does not cover lies at (-1e9, -1e9).
  std::vector<glm::vec2> drawn_position;
};

constexpr double kNearPlane_m = 0.01;

/// The same drawn picture: size, pinhole and pose, bit for bit.
inline bool same_view(const PinholeCamera& a, const PinholeCamera& b) {
  return a.width_px == b.width_px && a.height_px == b.height_px && a.fx == b.fx && a.fy == b.fy && a.cx == b.cx &&
         a.cy == b.cy && a.world_from_camera == b.world_from_camera;
}

/// `size`: of the photograph; the calibration is scaled to it. Error value_invalid: a lens that sees more than 160
/// degrees cannot be drawn with one pinhole; a pose that is no rotation and translation.
Result<RenderCamera> make_render_camera(const LensModel& lens, const glm::dmat4& world_from_camera, int width_px,
                                        int height_px);

/// Through pixel (x, y) goes corner + x right + y down, from the eye, of unit depth; metres relative to an origin.
struct PixelRays {
  glm::vec3 eye{0.0f}, corner{0.0f}, right{0.0f}, down{0.0f};
  PixelRays() = default;
  PixelRays(const PinholeCamera& camera, const glm::dvec3& origin);
  glm::vec3 ray(float x, float y) const { return corner + x * right + y * down; }
};

} // namespace daylit
