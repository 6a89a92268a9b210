#pragma once

// What mouse and keys do to the view, without any window: turn the camera about a point, drag objects over the floor
// they stand on, switch parts of the light.

#include <optional>
#include <utility>
#include <vector>

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "runtime/base/render_camera.h"
#include "runtime/session/session.h"

namespace daylit {

/// A camera that looks at a point. Angles in radians.
struct Orbit {
  glm::dvec3 target{0.0};
  double azimuth = 0.0, elevation = 0.0, distance_m = 1.0; ///< of the eye, seen from the target

  /// The eye of a pose, about the point of its axis that is nearest to `near`; the camera is turned upright.
  static Orbit about(const glm::dmat4& world_from_camera, const glm::dvec3& near);
  void turn(const glm::dvec2& by_px); ///< the scene follows the mouse; never over the poles
  void zoom(double steps);            ///< a tenth nearer per step
  glm::dmat4 pose() const;            ///< world from camera
};

/// Where a ray meets the horizontal plane at `height_m`, before the eye; empty when it does not, or beyond 100 m.
std::optional<glm::dvec3> on_floor(const glm::dvec3& eye, const glm::dvec3& direction, double height_m);

/// State of the interaction. Pixels are of the photograph, (0, 0) the centre of the top left one.
class ViewControl {
public:
  explicit ViewControl(std::vector<glm::dvec3> object_positions) : positions_(std::move(object_positions)) {}

  /// Unit direction, world, in which a pixel looks.
  static glm::dvec3 direction(const glm::dvec2& pixel, const RenderCamera& camera);

  /// On an object: takes hold of it at its foot's height. Beside: turns the camera about `target`.
  void press(const glm::dvec2& pixel, const RenderCamera& camera, std::optional<std::size_t> object,
             const glm::dvec3& target);
  void move(const glm::dvec2& pixel, const RenderCamera& camera);
  void release() { held_.reset(), turning_ = false; }
  void scroll(double steps, const RenderCamera& camera);
  /// 1 direct, 2 indirect, 3 differential, g frame times, r back to the photograph's view, s save.
  void key(char which);

  const ShownParts& parts() const { return parts_; }
  bool shows_frame_times() const { return frame_times_; }
  /// Empty: the photograph's own view.
  const std::optional<Orbit>& orbit() const { return orbit_; }
  const glm::dvec3& position(std::size_t k) const { return positions_[k]; }
  std::optional<std::size_t> held() const { return held_; }
  /// Where an object came to stand; while it is held, the mouse says where it is.
  void place(std::size_t k, const glm::dvec3& position);
  /// Whether s was pressed since the last call.
  bool take_save() { return std::exchange(save_, false); }

private:
  std::vector<glm::dvec3> positions_;
  ShownParts parts_;
  bool frame_times_ = true, turning_ = false, save_ = false;
  std::optional<Orbit> orbit_;
  std::optional<std::size_t> held_;
  glm::dvec3 grip_{0.0}; ///< of the held object's position from the point under the mouse
  glm::dvec2 last_{0.0};
  glm::dvec3 target_{0.0}; ///< turned about: the objects
};

} // namespace daylit
