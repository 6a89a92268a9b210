#pragma once

// Where the camera stands, from printed square markers (ArUco) in its picture.
//
// Board frame, everywhere in daylit: x right, y up, z out of the board towards the viewer. Camera frame: x right,
// y down, z forward. World: z up, metres.

#include <array>
#include <string>
#include <vector>

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>

#include "scene/core/result.h"
#include "scene/image/image_formats.h"
#include "scene/lens/lens.h"

namespace daylit {

/// One marker on the board, printed upright.
struct PlacedMarker {
  int id = 0;
  double side_m = 0;        ///< outer side of its black square
  glm::dvec2 centre_m{0.0}; ///< in the board frame
};

struct BoardLayout {
  std::string dictionary = "6X6_250"; ///< with or without "DICT_" in front
  std::vector<PlacedMarker> markers;  ///< several: their places on the one board are known

  /// One marker whose centre is the board's origin.
  static BoardLayout single(const std::string& dictionary, int id, double side_m);
  /// `columns` x rows markers of one size, ids row by row from the top left, `gap_m` apart; origin in the middle.
  static Result<BoardLayout> grid(const std::string& dictionary, const std::vector<int>& ids, int columns,
                                  double side_m, double gap_m);
};

/// Corners of a marker in a picture: top left, top right, bottom right, bottom left of the print, pixels, sub-pixel.
/// The print is upright as its authors publish it: ArUco markers as OpenCV draws them, AprilTags as the AprilTag
/// library has them, which is OpenCV's drawing turned by 180 degrees.
struct SeenMarker {
  int id = 0;
  std::array<glm::dvec2, 4> corner_px{};
};

/// The board positions, metres, that belong to SeenMarker::corner_px. The only function where OpenCV's order and frame
/// (y down, clockwise from the top left) meet ours (y up).
std::array<glm::dvec2, 4> board_corners(const PlacedMarker& marker);

struct MarkerPose {
  glm::dmat4 world_from_camera{1.0};
  double reprojection_rms_px = 0;
  /// Of another pose that nearly fits, as a planar board often has: its tilt mirrored. Infinite: there is none.
  double second_rms_px = 0;
  std::vector<SeenMarker> seen; ///< all markers of the dictionary in the picture
  std::vector<int> ids_used;    ///< those of the board
  /// The view does not decide between two poses (a small marker seen nearly face on).
  bool tilt_uncertain() const;
};

/// All markers of a dictionary, by id. Error usage: unknown dictionary.
Result<std::vector<SeenMarker>> find_markers(const Rgb8Image& picture, const std::string& dictionary);

/// Pose of the camera from markers already found. Errors: not_found (which ids were looked for, which were seen),
/// value_invalid (size or layout).
Result<MarkerPose> marker_pose(const std::vector<SeenMarker>& seen, const LensModel& lens, const BoardLayout& board,
                               const glm::dmat4& world_from_board);

/// Both steps. The lens must be for the picture's size (or state none).
Result<MarkerPose> marker_pose(const Rgb8Image& picture, const LensModel& lens, const BoardLayout& board,
                               const glm::dmat4& world_from_board, const std::string& picture_name = "picture");

} // namespace daylit
