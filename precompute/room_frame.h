#pragma once

// The frame in which a room is baked: its middle at zero, its longest side 8 units, corners on a lattice that single
// precision represents exactly. Where the room stands and in which unit it was drawn then changes no bit: ties of the
// mesher and roundings of the rays fall the same way.

#include "precompute/bake.h"
#include "scene/room/room.h"

namespace daylit::precompute {

struct RoomFrame {
  glm::dvec3 origin{0.0}; ///< world metres of the local zero
  double unit_m = 1.0;    ///< world metres per local unit

  static RoomFrame of(const Room& room);
  glm::dvec3 to_local(const glm::dvec3& world) const { return (world - origin) / unit_m; }
  glm::dvec3 to_world(const glm::dvec3& local) const { return origin + unit_m * local; }
  /// Nearest point of the lattice: 2^-22 units, 3e-8 of the room.
  glm::dvec3 snapped(const glm::dvec3& world) const;
};

/// The room in its frame. Faces that are thinner than the lattice are left out and counted in `collapsed`.
Room room_in_frame(const Room& room, const RoomFrame& frame, std::size_t& collapsed);

/// bake() in the room's own frame; options, report and volume are in world metres.
Result<BasisVolume> bake_room(const RoomFile& room, const SkyPartition& partition, const BakeOptions& options,
                              const Progress& progress, BakeReport& report);

/// count_bake() in the room's own frame.
Result<BakeReport> count_room_bake(const RoomFile& room, const SkyPartition& partition, const BakeOptions& options);

} // namespace daylit::precompute
