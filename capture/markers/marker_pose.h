#pragma once

// Where the camera stands, from printed square markers in its picture. Camera frame: x right, y down, z forward.
// World: z up, metres.

#include <string>
#include <vector>

#include <glm/mat4x4.hpp>

#include "capture/markers/find_markers.h"
#include "scene/core/result.h"
#include "scene/image/image_formats.h"
#include "scene/lens/lens.h"

namespace daylit {

struct MarkerPose {
  glm::dmat4 world_from_camera{1.0};
  double reprojection_rms_px = 0;
  /// Of another pose that nearly fits, as a planar board often has: its tilt mirrored. Infinite: there is none.
  double second_rms_px = 0;
  glm::dmat4 second_world_from_camera{1.0}; ///< that other pose, where second_rms_px is finite
  /// Reprojection error of the second solution of the planar problem over that of the first, at least 1. Unlike
  /// second_rms_px it counts a second solution that a refinement would lead back to the first.
  double ambiguity = 1;
  std::vector<SeenMarker> seen; ///< all markers of the dictionary in the picture
  std::vector<int> ids_used;    ///< those of the board that fit it
  /// The view does not decide between two poses (a small marker seen nearly face on).
  bool tilt_uncertain() const;
};

/// Pose of the camera from markers already found. An id that is seen twice is not used, nor are markers that do not lie
/// where the others say (three at least). Errors: not_found (which ids were looked for, which were seen), value_invalid
/// (size or layout).
Result<MarkerPose> marker_pose(const std::vector<SeenMarker>& seen, const LensModel& lens, const BoardLayout& board,
                               const glm::dmat4& world_from_board);

/// All markers of the board again, looked for where the pose puts them: those that were not recognised (too small, too
/// oblique) are found by the edges of their squares, and all start from a better place. Corners as find_markers()
/// gives.
std::vector<SeenMarker> find_on_board(const Rgb8Image& picture, const LensModel& lens, const BoardLayout& board,
                                      const glm::dmat4& camera_from_board, double exponent = kPhotographExponent);

/// Markers already found, and where the board has several of them, found again on the board, from both poses that the
/// markers allow. Error not_found also where most of the markers that the pose puts into the picture are not there.
Result<MarkerPose> refined_marker_pose(const Rgb8Image& picture, const std::vector<SeenMarker>& seen,
                                       const LensModel& lens, const BoardLayout& board,
                                       const glm::dmat4& world_from_board, double exponent = kPhotographExponent);

/// Finding and locating. The lens must be for the picture's size (or state none). `exponent`: as in find_markers().
Result<MarkerPose> marker_pose(const Rgb8Image& picture, const LensModel& lens, const BoardLayout& board,
                               const glm::dmat4& world_from_board, const std::string& picture_name = "picture",
                               double exponent = kPhotographExponent);

/// Error value_invalid: the lens file is for pictures of another size.
Result<void> check_lens_size(const Rgb8Image& picture, const LensModel& lens, const std::string& picture_name);

} // namespace daylit
