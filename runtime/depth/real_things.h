#pragma once

// Things that stand in the real room and not in its model, as a depth picture shows them.
//
// A pixel shows such a thing where the measured depth is nearer than the model by more than the depth's noise and the
// model's accuracy. Everywhere else, in holes too, the model decides: where both agree it is the smoother of the two.
// What the model has and the depth picture has not is left to the model.

#include <cstddef>
#include <optional>
#include <vector>

#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "runtime/base/render_camera.h"
#include "runtime/picture/picture_renderer.h"
#include "scene/image/depth_picture.h"
#include "scene/lens/lens.h"
#include "scene/room/ray_scene.h"

namespace daylit {

/// On the surface of a thing, world.
struct ThingPoint {
  glm::dvec3 position{0.0}, normal{0.0}; ///< the normal is a unit vector towards the camera's side
};

/// Pixels are those of the drawn picture (PinholeCamera). Thread-safe but for find().
class RealThings {
public:
  static constexpr int kTile = 8; ///< pixels on a side of a tile

  /// `depth`: of the photograph's view, its width and height those of the photograph or a whole fraction (each of its
  /// pixels then stands for a square of the photograph's). `noise_m`: deviation of a depth 1 m away. `renderer`: may
  /// know what the room shows; else rays are cast. May be null.
  void find(const DepthPicture& depth, double noise_m, const RenderCamera& camera, const LensModel& lens,
            const RayScene& room_rays, const PictureRenderer* renderer);

  bool any() const { return any_; }
  std::size_t pixels() const { return pixels_; } ///< that show one
  int width_px() const { return camera_.width_px; }
  int height_px() const { return camera_.height_px; }
  const PinholeCamera& camera() const { return camera_; }
  /// Depth along the optical axis, metres; 0: the pixel shows none.
  float z(int x, int y) const { return z_[index(x, y)]; }
  /// How deep a thing is taken to be behind its front, metres: as it is wide or high in the picture, whichever is less.
  float thickness_m(int x, int y) const { return thickness_m_[index(x, y)]; }
  double thickest_m() const { return thickest_m_; }
  /// Inside a thing: all pixels around show one too.
  bool is_inner(int x, int y) const { return inner_[index(x, y)] != 0; }
  bool tile_has_inner(int x, int y) const {
    return tiles_[static_cast<std::size_t>(y / kTile) * tile_columns() + x / kTile] != 0;
  }
  /// Depths that differ by less may be the same: 2 mm, and three deviations of the noise, which grows with z^2.
  double tolerance_m(double z_m) const { return 0.002 + 3.0 * noise_m_ * z_m * z_m; }

  /// Empty where the pixel shows none.
  std::optional<ThingPoint> point(int x, int y) const;
  /// The camera does not see world point x: a thing stands before it.
  bool hide(const glm::dvec3& x) const;
  /// In the camera's frame: x right, y down, z forward.
  glm::dvec3 to_camera(const glm::dvec3& world) const { return camera_from_world_ * (world - camera_.eye()); }
  const glm::dmat3& camera_from_world() const { return camera_from_world_; }
  /// Box around the inner pixels, without what is behind their fronts, in the camera's frame, metres.
  const glm::dvec3& low() const { return low_; }
  const glm::dvec3& high() const { return high_; }

private:
  std::size_t index(int x, int y) const { return static_cast<std::size_t>(y) * camera_.width_px + x; }
  std::size_t tile_columns() const { return static_cast<std::size_t>((camera_.width_px + kTile - 1) / kTile); }
  void keep_nearer_than_room(const DepthPicture& depth, const RenderCamera& camera, const LensModel& lens,
                             const RayScene& room_rays, const PictureRenderer* renderer);
  void drop_specks();
  void find_inner();
  void find_thickness();
  bool is_surrounded(int x, int y) const;
  bool belong_together(std::size_t a, std::size_t b) const;
  glm::dvec3 seen(int x, int y) const;

  PinholeCamera camera_;
  glm::dmat3 camera_from_world_{1.0};
  double noise_m_ = 0.0, thickest_m_ = 0.0;
  std::vector<float> z_, thickness_m_;
  std::vector<std::uint8_t> inner_, tiles_;
  glm::dvec3 low_{0.0}, high_{0.0};
  std::size_t pixels_ = 0;
  bool any_ = false;
};

} // namespace daylit
