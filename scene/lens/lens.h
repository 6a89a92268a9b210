#pragma once

// Camera and fish-eye models, pure maths. Camera frame as in OpenCV and ROS: x right, y down, z forward.
// Pixel coordinates: (0, 0) is the centre of the top left pixel, as in OpenCV.

#include <array>
#include <filesystem>
#include <optional>
#include <string>

#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "scene/core/output_file.h"
#include "scene/core/result.h"

namespace daylit {

enum class LensKind {
  pinhole,     ///< plumb_bob / rational_polynomial distortion k1 k2 p1 p2 k3 [k4 k5 k6]
  equidistant, ///< Kannala-Brandt: theta_d = theta (1 + k1 t^2 + k2 t^4 + k3 t^6 + k4 t^8), t = theta; any angle < pi
};

/// A calibrated camera as in the YAML of ROS / Kalibr. Unlike cv::fisheye the equidistant model is an angle model:
/// theta = atan2(hypot(x, y), z), so that rays behind the lens plane (fields of view over 180 degrees) are exact.
struct LensModel {
  LensKind kind = LensKind::pinhole;
  int width_px = 0, height_px = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0; ///< pixels
  std::array<double, 8> distortion{};    ///< unused trailing entries are zero
  /// Largest angle from the optical axis, radians, that the calibration covers; pixels beyond carry no weight.
  double max_theta = 1.5707963267948966;
  glm::dmat3 world_from_camera{1.0}; ///< rotation, columns = camera axes in the world

  /// Pixel of a camera-frame direction (any length); empty outside the calibrated field or behind a pinhole.
  std::optional<glm::dvec2> project(const glm::dvec3& camera_direction) const;
  /// Unit camera-frame direction through a pixel; empty outside the calibrated field. Newton inverse, 1e-12.
  std::optional<glm::dvec3> unproject(const glm::dvec2& pixel) const;
  /// Whether unproject() gives a direction there.
  bool covers(const glm::dvec2& pixel) const;
  /// Steradians per square pixel at a pixel position (analytic Jacobian of unproject); 0 outside the field.
  double solid_angle_density(const glm::dvec2& pixel) const;
};

/// Largest angle up to `limit` over which the distortion curve rises; beyond it a lens polynomial folds back.
double monotone_field(LensKind kind, const std::array<double, 8>& distortion, double limit);

/// Ideal equidistant fish-eye of `field_of_view` radians whose circle touches the shorter image side.
LensModel ideal_fisheye(int width_px, int height_px, double field_of_view);
/// Ideal pinhole of horizontal field of view, radians, principal point in the middle.
LensModel ideal_pinhole(int width_px, int height_px, double horizontal_fov);

/// ROS camera_info / Kalibr camera chain (cam0) / OpenCV FileStorage YAML: camera_matrix, distortion_model (absent:
/// told from the number of coefficients, as OpenCV writes it), distortion_coefficients, image_width and image_height
/// (both absent: 0, "as the image"), and two keys of our own: `world_from_camera` (rotation, 9 numbers, row-major) and
/// `max_theta_deg` (angle from the axis that the calibration covers; 90 when absent). Error: file, key, what is
/// expected there; a curve that folds back before that angle and inside the picture.
Result<LensModel> read_lens(const std::filesystem::path& path);
Result<LensModel> parse_lens(const std::string& yaml_text, const std::string& name);
constexpr FileKind kLensKind{"a lens file of daylit", "%YAML 1.0\n---\n# Lens of daylit:"};
Result<void> write_lens(const std::filesystem::path& path, const LensModel& lens);

} // namespace daylit
