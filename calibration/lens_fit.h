#pragma once

// Lens and board poses from the corners of one board in several pictures: least squares of the reprojection error
// (Zhang 2000, section 3.2; Kannala & Brandt 2006, section 4), for both lens models of scene/lens/lens.h. The lens is
// an angle model, so that corners beyond 86 degrees from the axis, where cv::fisheye breaks, count as others do.

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "scene/core/result.h"
#include "scene/lens/lens.h"

namespace daylit::calibration {

/// What one picture shows of a board: corners, and where on the board each of them is.
struct BoardView {
  std::string name;
  std::vector<glm::dvec2> corner_px;
  std::vector<glm::dvec3> board_m; ///< as many, in the board's own plane z = 0
  bool over_exposed = false;       ///< most of the board's white is at the top of the range
};

/// Inner corners of a checkerboard, metres, in its own plane z = 0; row by row.
std::vector<glm::dvec3> board_points(int columns, int rows, double square_m);

/// camera_from_board: a rotation vector (Rodrigues), radians, and a translation, metres.
struct BoardPose {
  glm::dvec3 rotation{0.0}, translation{0.0};
  glm::dvec3 apply(const glm::dvec3& board_point) const;
};

struct LensFit {
  LensModel lens;
  std::vector<BoardPose> pose;
  std::vector<double> view_rms_px; ///< root mean square distance of corners, of each view
  double rms_px = 0;
  /// Standard deviations of fx, fy, cx, cy (pixels) and of the distortion coefficients, from the covariance
  /// rms^2 (J^T J)^-1.
  std::array<double, 12> sigma{};
  double sigma_aspect = 0; ///< the same of fx / fy
};

inline constexpr std::size_t kFewestViews = 3; ///< from which a lens follows

/// Where to begin: an image circle, pixels; radius 0: not known.
struct ImageCircle {
  glm::dvec2 centre{0.0};
  double radius = 0;
};

/// The lens of `kind` for pictures of this size. Errors: value_invalid, fewer than three views, or no lens of any focal
/// length explains them.
Result<LensFit> fit_lens(LensKind kind, int width_px, int height_px, const ImageCircle& circle,
                         std::span<const BoardView> views);

/// The same from a lens that is nearly right already: for views that were added or left out. Without `curve_free` its
/// distortion stays as it is.
std::optional<LensFit> refit_lens(const LensModel& start, std::span<const BoardView> views, bool curve_free = true);

/// Rms reprojection error, pixels, of a view that had no part in the fit: its pose alone is estimated.
std::optional<double> held_out_rms(const LensModel& lens, const BoardView& view);

} // namespace daylit::calibration
