#pragma once

// Rays in packets of sixteen against a triangle mesh that may move, by Embree.

#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include <glm/vec3.hpp>

#include "runtime/base/lanes.h"
#include "runtime/trace/rigid_motion.h"
#include "scene/core/result.h"
#include "scene/room/ray_scene.h"

namespace daylit {

constexpr std::uint32_t kNoTriangle = 0xFFFFFFFFu;

/// Is told of the hits of a packet's rays.
class HitVisitor {
public:
  virtual void meet(int lane, std::uint32_t triangle, float distance, float u, float v) = 0;

protected:
  ~HitVisitor() = default;
};

/// In single precision: give coordinates relative to a point nearby. Directions need not be unit: distances are in
/// their lengths.
class PacketScene {
public:
  enum class Edges {
    watertight, ///< Embree's robust mode: no ray passes between neighbours
    quick,      ///< one in some millions does
  };
  enum class Hits { nearest, all_too }; ///< what may be asked for
  /// An empty mesh is allowed: no ray meets it. Error: out of memory.
  static Result<PacketScene> build(std::span<const glm::vec3> vertices,
                                   std::span<const std::array<std::uint32_t, 3>> triangles,
                                   Edges edges = Edges::watertight, Hits hits = Hits::nearest);
  /// New positions of the same vertices: the hierarchy is refitted, not rebuilt. Not thread-safe.
  Result<void> move(std::span<const glm::vec3> vertices);
  /// The mesh moved as a whole: nothing is refitted, rays are transformed instead. `to_given`: to where its vertices
  /// were given last.
  void set_transform(const Similarity& to_given) { to_given_ = to_given; }

  /// Bits of `lanes` whose ray is blocked on [tnear, tfar].
  LaneMask occluded(LaneMask lanes, const RayPacket16& rays) const;
  /// Nearest hits of `lanes`; the other lanes are kNoTriangle.
  void closest(LaneMask lanes, const RayPacket16& rays, RayHits16& hits) const;
  /// Every hit of `lanes`, in no order. The scene must be built for it. The coordinates of their directions have the
  /// same signs: of a packet of several octants Embree 3.13 tells some hits twice.
  void all(LaneMask lanes, const RayPacket16& rays, HitVisitor& visitor) const;
  bool empty() const { return empty_; }

private:
  struct Handle;
  std::shared_ptr<Handle> handle_;
  Similarity to_given_;
  bool empty_ = true;
};

} // namespace daylit
