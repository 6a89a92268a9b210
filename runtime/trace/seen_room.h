#pragma once

// What a camera sees of the room by rays: its surfaces as far as its openings.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "runtime/trace/packet_scene.h"
#include "scene/room/aperture.h"
#include "scene/room/room.h"

namespace daylit {

/// The room's triangles relative to an origin, as they are traced, and after them those of the openings.
struct RoomMesh {
  std::vector<glm::vec3> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::uint32_t> source; ///< in the room, but for the openings
  std::vector<glm::vec3> normals;    ///< of the triangles, unit; of openings those to the inside
};

/// What of the room is seen along rays. Nothing of it beyond an opening through which a ray leaves: what stands outside
/// is lit by a sky that the volume does not know. `mesh`: what `rays` was built from.
struct SeenRoom {
  const PacketScene& rays;
  const RoomMesh& mesh;
  /// Triangles and distances as PacketScene::closest().
  void closest(LaneMask lanes, RayPacket16 along, RayHits16& hits) const;
};

/// The reflecting triangles of a room, relative to an origin, without normals.
RoomMesh room_mesh(const Room& room, const glm::dvec3& origin, std::span<const std::uint32_t> triangles);
/// Of the room: those of no window.
std::vector<std::uint32_t> reflecting_triangles(const Room& room);
void add_openings(RoomMesh& mesh, std::span<const Aperture> apertures, const glm::dvec3& origin);

} // namespace daylit
