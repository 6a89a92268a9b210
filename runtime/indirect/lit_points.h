#pragma once

// Points of the room whose light, without the objects and unshadowed, is looked up again in every frame. Under another
// sky those that were asked for last are renewed together: sixteen take little longer than one.

#include <atomic>
#include <cstdint>
#include <mutex>
#include <span>
#include <vector>

#include "runtime/indirect/room_light.h"

namespace daylit {

struct LitPoint {
  RoomLight::KnownPoint at;
  RoomPoint light;
  bool is_kept = false;                    ///< LitPoints knows it
  std::atomic<std::uint64_t> made{0};      ///< sky of `light`
  std::atomic<std::uint64_t> asked_for{0}; ///< sky under which it last was
  std::mutex renewing;
};

/// Keeps references to the room's light and to the points.
class LitPoints {
public:
  explicit LitPoints(const RoomLight& light) : light_(light) {}

  /// Of a point of a triangle where the normal is n. Thread-safe.
  const RoomPoint& light(LitPoint& point, std::uint32_t triangle, const glm::dvec3& x, const glm::dvec3& n);
  /// Another light of the room, through these cells of the windows, which must live until the next. Before the first
  /// there is none. Points that nobody asked for under the last are forgotten until they are again.
  void sky_changed(std::span<const ApertureCell> windows);
  void clear() { points_.clear(); } ///< before the points go
  std::size_t size() const { return points_.size(); }

private:
  const RoomLight& light_;
  std::span<const ApertureCell> windows_;
  std::uint64_t sky_ = 1;
  std::vector<LitPoint*> points_;
  std::mutex adding_;
};

} // namespace daylit
