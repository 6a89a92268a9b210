#include "runtime/trace/seen_room.h"

#include <glm/geometric.hpp>

namespace daylit {

RoomMesh room_mesh(const Room& room, const glm::dvec3& origin, std::span<const std::uint32_t> triangles) {
  RoomMesh mesh;
  for (const glm::dvec3& v : room.vertices)
    mesh.vertices.emplace_back(v - origin);
  for (const std::uint32_t i : triangles) {
    mesh.triangles.push_back(room.triangles[i].vertex);
    mesh.source.push_back(i);
  }
  return mesh;
}

/// Convex, as fans.
void add_openings(RoomMesh& mesh, std::span<const Aperture> apertures, const glm::dvec3& origin) {
  for (const Aperture& a : apertures) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (const glm::dvec3& corner : a.corners)
      mesh.vertices.emplace_back(corner - origin);
    for (std::uint32_t k = 2; k < a.corners.size(); ++k) {
      mesh.triangles.push_back({first, first + k - 1, first + k});
      mesh.normals.emplace_back(a.inward);
    }
  }
}

std::vector<std::uint32_t> reflecting_triangles(const Room& room) {
  std::vector<std::uint32_t> list;
  for (std::uint32_t i = 0; i < room.triangles.size(); ++i)
    if (!room.is_window(room.triangles[i]))
      list.push_back(i);
  return list;
}

/// Behind an opening through which a ray enters, the room goes on.
void SeenRoom::closest(LaneMask lanes, RayPacket16 along, RayHits16& hits) const {
  constexpr float kBehind = 1.0f + 1e-5f;
  rays.closest(lanes, along, hits);
  for (LaneMask entering = lanes; entering != 0;) {
    entering = 0;
    for (std::size_t k = 0; k < kLanes; ++k)
      if ((lanes >> k & 1u) && hits.triangle[k] != kNoTriangle && hits.triangle[k] >= mesh.source.size()) {
        if (glm::dot(along.direction(k), mesh.normals[hits.triangle[k]]) > 0.0f)
          entering |= 1u << k;
        else
          hits.triangle[k] = kNoTriangle;
        along.tnear[k] = kBehind * hits.distance[k];
      }
    if (RayHits16 behind; entering != 0) {
      rays.closest(entering, along, behind);
      for (std::size_t k = 0; k < kLanes; ++k)
        if (entering >> k & 1u)
          hits.triangle[k] = behind.triangle[k], hits.distance[k] = behind.distance[k];
    }
  }
}

} // namespace daylit
