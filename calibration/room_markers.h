#pragma once

// The size of a room from printed markers on its surfaces, seen in a few photographs.

#include <array>
#include <map>
#include <span>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include "calibration/report.h"
#include "capture/markers/board.h"
#include "scene/core/result.h"
#include "scene/lens/lens.h"

namespace daylit::calibration {

/// Surfaces of a box or an L-shape: the walls as in room_plan.h, "floor" and "ceiling".
inline constexpr std::array<const char*, 8> kSurfaceNames = {"floor", "ceiling", "x0",    "x1",
                                                             "y0",    "y1",      "cut_x", "cut_y"};

struct RoomMarkers {
  std::string dictionary = "6X6_250";
  double side_m = 0;             ///< of the black square of each
  double margin_m = 0;           ///< of white paper around it
  std::map<int, std::string> on; ///< by id: the surface that the marker is flat on, turned in any way
};

struct RoomPhotograph {
  std::string file;
  std::vector<SeenMarker> seen;
};

struct MeasuredRoom {
  std::map<std::string, double> place_m, sigma_m;    ///< of "ceiling", "x1", "y1", "cut_x", "cut_y" that have a marker
  std::map<int, std::array<glm::dvec3, 4>> corner_m; ///< of each marker that was seen, in the room; as SeenMarker
  std::map<int, double> marker_rms_px;               ///< how far its corners are from where the room has them
  double rms_px = 0;                                 ///< the same of all
  std::vector<std::string> used;                     ///< photographs
  std::vector<DroppedPicture> dropped;
};

/// Origin in the corner of floor, x0 and y0; these, x1 and y1 need a marker each. Surfaces are taken as flat and at
/// right angles: the unknowns are the places of the far ones, the cameras, and place and turn of each marker in its
/// surface; least squares over the corners in the photographs (Levenberg-Marquardt), begun from the pose of each marker
/// by itself and the directions that surfaces face. Errors (not_found): surfaces without a marker; photographs that no
/// marker connects; no photograph with markers on two surfaces that meet.
Result<MeasuredRoom> measure_room(const RoomMarkers& markers, const LensModel& lens,
                                  std::span<const RoomPhotograph> photographs);

} // namespace daylit::calibration
