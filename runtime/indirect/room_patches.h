#pragma once

// The room's light far from where it is looked at closely: one value per patch of a plane, without the sun's, whose
// edges are sharp. For what stands behind virtual objects.

#include <atomic>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include <tbb/concurrent_unordered_map.h>

#include "runtime/indirect/room_light.h"
#include "runtime/indirect/room_planes.h"
#include "runtime/indirect/window_visibility.h"

namespace daylit {

/// Part of a plane of the room, seen from one side, of one material.
struct RoomPatch {
  bool lit = false; ///< some point of it lies in the air of the room
  glm::dvec3 point{0.0}, normal{0.0};
  VertexProbes probes;
  float visible = 0.0f; ///< part of the windows that its point sees past the room
  Rgb reflectance{0.5f}, irradiance{0.0f};
  Rgb lamp_first{0.0f}, lamp_later{0.0f}; ///< irradiance from lamps (lamp_light.h): straight; by way of the room
  LatticeKey cell{};                      ///< its square on the plane
  std::uint32_t material = 0;
  std::atomic<std::uint64_t> frame{0}; ///< that `irradiance` belongs to
  std::mutex renewing;
};

/// Keeps references to everything given. Thread-safe but for set_frame().
class RoomPatches {
public:
  static constexpr double kSide_m = 0.35; ///< of a patch
  RoomPatches(const Room& room, const RayScene& rays, const RoomPlanes& planes, const RoomLight& light,
              const WindowVisibility& windows)
      : room_(room), rays_(rays), planes_(planes), light_(light), visibility_(windows) {}

  /// `pyramid` must live until the next frame.
  void set_frame(std::span<const SkyMap> pyramid);
  /// Cells of the windows as the middle of the room sees them, as wide as that fraction of the distance.
  std::vector<ApertureCell> window_cells(double fraction) const;
  /// Wide ones.
  std::span<const ApertureCell> windows() const { return windows_; }
  /// The patch of a point that a ray along `direction` meets. Valid as long as this.
  RoomPatch* at(std::uint32_t triangle, const glm::dvec3& x, const glm::dvec3& direction) const;
  /// Of the room's surface in it, found by points.
  double area_m2(const RoomPatch& patch) const;
  /// Indirect, and of the sky what comes past the room.
  Rgb irradiance(RoomPatch& patch) const;

private:
  bool is_surface(const RoomPatch& patch, const glm::dvec3& point) const;

  const Room& room_;
  const RayScene& rays_;
  const RoomPlanes& planes_;
  const RoomLight& light_;
  const WindowVisibility& visibility_;
  std::span<const SkyMap> pyramid_;
  std::vector<ApertureCell> windows_;
  std::uint64_t frame_ = 0;
  mutable tbb::concurrent_unordered_map<LatticeKey, std::unique_ptr<RoomPatch>, LatticeHash> patches_;
};

} // namespace daylit
