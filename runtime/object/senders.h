#pragma once

// Which vertices of a mesh send light to the room, to other objects and into what mirrors them.

#include <cstdint>
#include <vector>

#include "scene/model/object_mesh.h"

namespace daylit {

/// Of a mesh with no more vertices each sends light itself.
constexpr std::size_t kMostSenders = 16384;
/// The same of one that mirrors all over: its vertices' light is not seen, only what they send.
constexpr std::size_t kMostMirrorSenders = 1024;

/// Per vertex: the one that sends light for it, which is itself in a mesh of at most so many. In a denser one it is the
/// first vertex in the same cell, a twentieth of the mesh wide, whose normal lies in the same octant: what is sent is
/// the mean over many of them anyway, and costs as much as a small mesh.
std::vector<std::uint32_t> find_senders(const ObjectMesh& mesh, std::size_t most = kMostSenders);

} // namespace daylit
