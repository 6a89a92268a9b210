#pragma once

// The planes of a room and a square lattice on each side of each: where light that changes slowly over a wall is kept.

#include <array>
#include <cstdint>
#include <vector>

#include <glm/vec3.hpp>

#include "scene/room/ray_scene.h"
#include "scene/room/room.h"

namespace daylit {

/// Light on surfaces is looked up, and rays start, this far in front of them, metres.
constexpr double kAirGap_m = 1e-4;

/// Cell of a square lattice, with the bilinear weights of its corners: (0, 0), (1, 0), (0, 1), (1, 1).
struct LatticeSquare {
  std::int64_t i = 0, j = 0;
  std::array<float, 4> weight{1.0f, 0.0f, 0.0f, 0.0f};
};

/// A plane of the room seen from one side.
struct RoomFacing {
  glm::dvec3 normal{0.0}, u{0.0}, v{0.0};
  double height = 0.0; ///< dot(normal, x) on the plane
  glm::dvec3 corner(std::int64_t i, std::int64_t j, double cell_m) const {
    return height * normal + cell_m * (static_cast<double>(i) * u + static_cast<double>(j) * v);
  }
  /// That x, on the plane, lies in.
  LatticeSquare square(const glm::dvec3& x, double cell_m) const;
};

/// No surface of the room stands between any two of the four points, world metres, or within kAirGap_m beyond one of
/// them: a point on a wall is in the air of neither side.
bool see_each_other(const RayScene& room_rays, const std::array<glm::dvec3, 4>& points);

class RoomPlanes {
public:
  explicit RoomPlanes(const Room& room);
  /// Of the side of a triangle that a ray along `direction` meets.
  std::uint32_t facing_of(std::uint32_t triangle, const glm::dvec3& direction) const;
  const RoomFacing& operator[](std::uint32_t facing) const { return facings_[facing]; }

private:
  std::vector<RoomFacing> facings_; ///< 2 k and 2 k + 1: the two sides of plane k
  std::vector<std::uint32_t> plane_of_triangle_;
};

struct LatticeKey {
  std::int64_t i = 0, j = 0;
  std::uint32_t facing = 0;
  bool operator==(const LatticeKey&) const = default;
};
struct LatticeHash {
  std::size_t operator()(const LatticeKey& k) const {
    std::uint64_t h = static_cast<std::uint64_t>(k.i) * 0x9E3779B97F4A7C15ull;
    h ^= static_cast<std::uint64_t>(k.j) * 0xC2B2AE3D27D4EB4Full + (h >> 29);
    h ^= k.facing * 0x165667B19E3779F9ull + (h << 7);
    return static_cast<std::size_t>(h ^ (h >> 32));
  }
};

} // namespace daylit
