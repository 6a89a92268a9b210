#pragma once

// Which vertices of a mesh send light to the room, to other objects and into what mirrors them.

#include <cstdint>
#include <vector>

#include <glm/vec3.hpp>

#include "scene/model/object_mesh.h"

namespace daylit {

/// Of a mesh with no more vertices each sends light itself.
constexpr std::size_t kMostSenders = 131072;
/// The same of one that mirrors all over: its vertices' light is not seen, only what they send.
constexpr std::size_t kMostMirrorSenders = 1024;

struct MeshSenders {
  std::vector<std::uint32_t> vertex; ///< those that send, ascending
  std::vector<std::uint32_t> of;     ///< per vertex of the mesh: which of them sends for it
  /// Per vertex: it lies beside its sender, in a cell of the foot, and has the same light. Empty: all send themselves.
  std::vector<std::uint8_t> at_foot;
};

/// In a mesh of at most so many vertices each sends for itself. In a denser one the first vertex in the same cell, a
/// fortieth of the mesh wide, whose normal lies in the same octant does: what is sent is the mean over many of them
/// anyway, and costs as much as a small mesh. Not so at the foot, next to the floor on which the object stands: there
/// light falls to nothing within millimetres, and cells are up to four times finer. Where more than `most` cells have a
/// vertex they are wider, up to a tenth. `up`: the vertical, unit, frame of the mesh.
MeshSenders find_senders(const ObjectMesh& mesh, const glm::vec3& up, std::size_t most = kMostSenders);

} // namespace daylit
