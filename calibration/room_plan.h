#pragma once

// A box or an L-shaped room from lengths that were measured with a tape, or in photographs of markers.

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "calibration/room_markers.h"
#include "scene/core/result.h"
#include "scene/room/room.h"

namespace daylit::calibration {

/// Walls by name: x0, y0, x1, y1 are the sides of the room at the least and the largest x and y; of an L-shaped room
/// cut_x and cut_y are the two walls at the corner that is missing (at largest x and y).
inline constexpr std::array<const char*, 6> kWallNames = {"y0", "x1", "cut_y", "cut_x", "y1", "x0"};

struct PlanWindow {
  std::string wall;
  double left_m = 0, sill_m = 0; ///< from the left end of the wall as it is seen from inside; above the floor
  double width_m = 0, height_m = 0;
  double transmittance = 0.8;
  std::optional<std::array<int, 2>> markers; ///< at its lower left and upper right corners: they give the lengths
};

/// What stands in the place of the room's size: photographs of printed markers on its surfaces.
struct PlanPhotographs {
  std::filesystem::path lens;
  std::vector<std::filesystem::path> images;
  RoomMarkers markers;
};

/// A block that stands in the room: a cupboard, or with `below_m` a table's top.
struct PlanBlock {
  std::string name; ///< of its material
  glm::dvec2 corner_m{0.0};
  glm::dvec3 size_m{0.0};
  double below_m = 0; ///< air under it
  Rgb reflectance{0.5f};
};

struct RoomPlan {
  glm::dvec3 size_m{0.0};                      ///< along x, along y, height
  glm::dvec2 cut_m{0.0};                       ///< of the corner at largest x and y that is missing; 0: a box
  std::optional<double> diagonal_m;            ///< of the floor, from the corner (0, 0) to the far end of wall x1
  Rgb floor{0.2f}, walls{0.7f}, ceiling{0.8f}; ///< reflectances
  std::vector<PlanWindow> windows;
  std::vector<PlanBlock> blocks;
  std::optional<PlanPhotographs> photographs;

  bool is_box() const { return !(cut_m.x > 0.0); }
  /// Corners of the floor, counter-clockwise from (0, 0).
  std::vector<glm::dvec2> outline() const;
  /// Wall k of kWallNames: its ends in the order of outline(); empty where the room has none of that name.
  std::optional<std::array<glm::dvec2, 2>> wall(const std::string& name) const;
  /// What `diagonal_m` must be.
  double computed_diagonal_m() const;
};

/// TOML: size = [x, y, z], cut = [x, y], diagonal, floor, walls, ceiling (reflectances), [[window]] wall, left, sill,
/// width, height, transmittance, [[block]] name, corner = [x, y], size = [x, y, z], below, reflectance. In the place of
/// size and cut: [photographs] lens, dictionary, side, margin, [[photograph]] image, [[marker]] id, on, and height
/// where no marker is on the ceiling; a window may then have lower_left and upper_right = ids in the place of its
/// lengths. Error: every problem of the file with its line.
Result<RoomPlan> read_room_plan(const std::filesystem::path& path);

/// What contradicts itself, each with what to measure again: windows that leave their wall or meet each other, blocks
/// outside the room, a diagonal that does not fit, lengths that are no metres.
std::vector<std::string> contradictions(const RoomPlan& plan);

/// z up, origin in the corner; materials floor, ceiling, wall_x0 ..., window_1 ..., and the blocks'.
Room room_of(const RoomPlan& plan);

} // namespace daylit::calibration
