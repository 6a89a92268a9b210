#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace daylit {

/// What a frame found out that its user can do something about.
struct FrameState {
  std::size_t vertices_outside = 0, vertices = 0; ///< of the light field
  std::size_t object_pixels = 0, lights = 0;
  bool camera_among_objects = false, sky_black = false;
};

/// One line each, with what to do.
std::vector<std::string> frame_warnings(const FrameState& state);

} // namespace daylit
