#pragma once

// Where a camera stands and how it is turned, from printed markers anywhere in its field, behind the lens plane too.

#include <vector>

#include <glm/mat4x4.hpp>

#include "capture/markers/find_markers.h"
#include "scene/core/result.h"
#include "scene/lens/lens.h"

namespace daylit::calibration {

struct LocatedBoard {
  glm::dmat4 world_from_camera{1.0};
  std::vector<int> ids;        ///< markers used
  double rms_px = 0;           ///< of the corners, in a view of about the lens's own pixels per degree
  double sigma_deg = 0;        ///< of the turn about the worst axis, one standard deviation
  double sigma_m = 0;          ///< of the position along the worst axis
  bool tilt_uncertain = false; ///< as MarkerPose
  /// Unit directions in the camera frame of the corners of those markers, and where they are: metres, world.
  std::vector<glm::dvec3> corner_camera, corner_world;
};

/// Markers are looked for in pinhole views in all directions of the field, 60 degrees across, then once more in a view
/// with the board in its middle: detectors and the planar pose want straight lines. `radiance` linear. Error not_found:
/// which ids were looked for, and which were seen.
Result<LocatedBoard> locate_board(const RgbImage& radiance, const LensModel& lens, const BoardLayout& board,
                                  const glm::dmat4& world_from_board);

} // namespace daylit::calibration
