#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "scene/volume/volume.h"

namespace daylit {

/// What a frame found out that its user can do something about.
struct FrameState {
  std::size_t vertices_outside = 0, vertices = 0; ///< of the light field
  std::size_t object_pixels = 0, lights = 0;
  bool camera_among_objects = false, sky_black = false;
};

/// One line each, with what to do.
std::vector<std::string> frame_warnings(const FrameState& state);

/// Work that is never done in a room, without a loss, a line each.
std::vector<std::string> skipped_exactly(const BasisVolume& volume, std::size_t room_occluders);

} // namespace daylit
