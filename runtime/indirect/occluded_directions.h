#pragma once

// The directions that virtual objects cover as seen from a point of the room, and what of the room is behind them: all
// of their effect on indirect light that does not depend on the light.

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "runtime/indirect/room_patches.h"
#include "runtime/indirect/window_visibility.h"
#include "runtime/object/placed_parts.h"
#include "runtime/object/ray_fan.h"
#include "runtime/object/relight.h"
#include "scene/core/orthonormal.h"
#include "scene/room/ray_scene.h"

namespace daylit {

/// One of them.
struct OccludedDirection {
  PartHit object;
  float weight = 0.0f;         ///< cos dw, sr
  RoomPatch* behind = nullptr; ///< null: the sky
  glm::dvec3 position{0.0};    ///< behind it; of the sky any point in the direction
};

/// Points spread evenly over the unit square, as what directions in a cone are made of; sets of fewer, too.
class DirectionPattern {
public:
  static constexpr int kPhases = 4; ///< patterns that fill each other's gaps
  explicit DirectionPattern(int count, int phase = 0);
  struct Point {
    double height = 0.0, cosine = 1.0, sine = 0.0; ///< first coordinate; of the angle that the second stands for
  };
  /// Half as many as often as that, at most twice.
  std::span<const Point> points(std::size_t halvings = 0) const { return points_[halvings]; }

private:
  std::array<std::vector<Point>, 3> points_;
};

/// Looks in the directions of the pattern, spread over the cone of a part's bounding sphere, as a point x with normal n
/// sees it. Appends those that the part covers before the room and before other parts.
void find_occluded(const RayScene& room, const RoomPatches& patches, const PlacedParts& parts, std::size_t part,
                   const glm::dvec3& x, const glm::dvec3& n, const DirectionPattern& pattern,
                   std::vector<OccludedDirection>& covered);

/// The same as a vertex of part `own` sees the other parts: past its own where `visible`, the cosine of a unit vector
/// with n, is not 0.
using VisibleCosine = std::function<float(const glm::vec3& direction)>;
void find_others(const RayScene& room, const RoomPatches& patches, const PlacedParts& parts, std::size_t own,
                 const glm::dvec3& x, const glm::dvec3& n, const VisibleCosine& visible,
                 const DirectionPattern& pattern, std::vector<OccludedDirection>& covered);

/// An object, and another whose own triangles hide nothing.
struct SeenFrom {
  std::size_t part = 0, ignored = 0;
};
/// The same of the directions in which one part lies, on all sides of x; the weights are solid angles, sr.
void find_occluded_by(const RayScene& room, const RoomPatches& patches, const PlacedParts& parts, const SeenFrom& seen,
                      const glm::dvec3& x, const DirectionPattern& pattern, std::vector<OccludedDirection>& covered);

/// A piece of the room as a point x sees it.
struct SeenPatch {
  RoomPatch* patch = nullptr;
  float weight = 0.0f; ///< cos dw of its directions, sr
};
/// The weight of directions that show one patch is summed: it is looked up once per light.
void add_patch(std::vector<SeenPatch>& seen, RoomPatch* patch, float weight);
/// What the room shows x with normal n in all directions of the pattern.
std::vector<SeenPatch> find_around(const RayScene& room, const RoomPatches& patches, const glm::dvec3& x,
                                   const glm::dvec3& n, const DirectionPattern& pattern);
/// 1 where x lies within the sphere of a part, 0 where all spheres cover so little that find_occluded() looks at their
/// cones and not around.
float surrounded(const PlacedParts& parts, const glm::dvec3& x);

/// By its cosine with n: cos = sqrt(1 - u) (Malley).
inline glm::dvec3 in_hemisphere(const OrthonormalBasis& basis, const glm::dvec3& n, const DirectionPattern::Point& p) {
  const double up = std::sqrt(1.0 - p.height), side = std::sqrt(p.height);
  return side * p.cosine * basis.u + side * p.sine * basis.v + up * n;
}

/// Where rays from x in the directions of the pattern meet the room, objects or none: seen(triangle, position,
/// direction). Sixteen at a time.
template <class Seen>
void look_around(const RayScene& room, const glm::dvec3& x, const glm::dvec3& n, const DirectionPattern& pattern,
                 const Seen& seen) {
  constexpr std::size_t kPacket = 16;
  const OrthonormalBasis basis(n);
  const std::span<const DirectionPattern::Point> points = pattern.points();
  for (std::size_t first = 0; first < points.size(); first += kPacket) {
    const std::size_t count = std::min(kPacket, points.size() - first);
    std::array<glm::dvec3, kPacket> direction;
    for (std::size_t k = 0; k < count; ++k)
      direction[k] = in_hemisphere(basis, n, points[first + k]);
    RayHits16 hits;
    const RayPacket16 rays = ray_fan(room.to_local(x), count, [&](std::size_t k) { return glm::vec3(direction[k]); });
    const std::uint32_t ends = room.closest16(rays, static_cast<int>(count), hits);
    for (std::size_t k = 0; k < count; ++k)
      if (ends >> k & 1u)
        seen(hits.triangle[k], x + static_cast<double>(hits.distance[k]) * direction[k], direction[k]);
  }
}

/// Radiance of the object there.
inline Rgb object_radiance(const OccludedDirection& covered, std::span<const TwoSided> radiance) {
  const PartHit& hit = covered.object;
  const float b[3] = {1.0f - hit.u - hit.v, hit.u, hit.v};
  Rgb sum(0.0f);
  for (int i = 0; i < 3; ++i) {
    const TwoSided& vertex = radiance[hit.vertex[i]];
    sum += b[i] * (hit.back ? vertex.back : vertex.front);
  }
  return sum;
}

/// The sun's part of the room's radiance that the object hides, as far as objects do not keep the sun away; sample k of
/// the sun stands for all.
inline Rgb sunlight_behind(const OccludedDirection& covered, std::size_t k, const WindowVisibility& windows,
                           const PlacedParts& parts) {
  if (!covered.behind || !windows.has_sun())
    return Rgb(0.0f);
  const glm::dvec3& n = covered.behind->normal;
  const glm::dvec3 air = covered.position + kAirGap_m * n;
  const Rgb past_objects = parts.passed(air, windows.sun_direction());
  if (past_objects == Rgb(0.0f))
    return past_objects;
  return past_objects * covered.behind->reflectance * windows.sun_sample(k, air, n) * std::numbers::inv_pi_v<float>;
}

} // namespace daylit
