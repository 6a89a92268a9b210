#pragma once

// Where the picture shows one plane of the room and nothing else: there one ray per block of pixels is enough.

#include <array>
#include <cstdint>
#include <vector>

#include <glm/vec3.hpp>

#include "runtime/base/render_camera.h"

namespace daylit {

/// The room's triangles relative to an origin, as they are traced.
struct RoomMesh {
  std::vector<glm::vec3> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::uint32_t> source; ///< in the room
};

/// Per block of `side` x `side` pixels, row-major: 0 when no edge of a triangle crosses the square from its first pixel
/// to the first pixels of the next blocks, a margin of half a pixel around it. Conservative. The visible surface then
/// changes in the square only where triangles cross each other; four corners that show the same triangle rule that out.
std::vector<std::uint8_t> blocks_with_outlines(const RoomMesh& room, const RenderCamera& camera,
                                               const glm::dvec3& origin, int side);

} // namespace daylit
