#include "runtime/indirect/occluded_directions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

#include "runtime/sky/window_sampler.h"

namespace daylit {

namespace {

constexpr int kPacket = 16;
constexpr double kWhole = 0.2; // cosine of half a cone's angle: wider ones are looked at as a whole hemisphere
// Of the hemisphere, by its cosine: what covers at most so much needs half of the directions, or a quarter.
constexpr double kSmall = 0.04, kTiny = 0.01;

/// Where the directions towards one part come from.
struct Cone {
  bool whole = false; ///< the hemisphere, by its cosine: the sphere covers most of what x sees
  double cos_max = 0.0;
  glm::dvec3 axis;
  OrthonormalBasis basis;

  /// On the side of n.
  Cone(const BoundingSphere& sphere, const glm::dvec3& x, const glm::dvec3& n) : Cone(sphere, x) {
    whole = cos_max < kWhole;
    if (whole) {
      axis = n;
      basis = OrthonormalBasis(n);
    }
  }
  /// On all sides of x.
  /// sin of its half angle: r / d.
  Cone(const BoundingSphere& sphere, const glm::dvec3& x) : axis(0.0, 0.0, 1.0), basis(axis) {
    const glm::dvec3 to = sphere.centre - x;
    const double distance = glm::length(to), s = sphere.radius / std::max(distance, 1e-9);
    cos_max = s < 1.0 ? std::sqrt(1.0 - s * s) : -1.0;
    if (distance > 0.0)
      axis = to / distance;
    basis = OrthonormalBasis(axis);
  }
  /// Uniform in the cone: cos = 1 - u (1 - cos_max).
  glm::dvec3 direction(const DirectionPattern::Point& p) const {
    if (whole)
      return in_hemisphere(basis, axis, p);
    const double up = 1.0 - p.height * (1.0 - cos_max);
    const double side = std::sqrt(std::max(0.0, 1.0 - up * up));
    return side * p.cosine * basis.u + side * p.sine * basis.v + up * axis;
  }
  /// How often the pattern's number of points is halved: r^2 / d^2 is the most that the sphere covers.
  std::size_t halvings() const {
    const double covers = cos_max > 0.0 ? 1.0 - cos_max * cos_max : 1.0;
    return covers > kSmall ? 0 : covers > kTiny ? 1 : 2;
  }
  /// cos dw of a direction at this cosine with the normal.
  float weight(double cosine, const DirectionPattern& pattern) const {
    const double all = 2.0 * std::numbers::pi * (1.0 - cos_max);
    const auto count = static_cast<double>(pattern.points(halvings()).size());
    return static_cast<float>((whole ? std::numbers::pi : all * cosine) / count);
  }
};

/// Directions with what they meet first, gathered until they fill a packet of room rays.
struct Candidates {
  std::array<glm::dvec3, kPacket> direction;
  std::array<OccludedDirection, kPacket> covered;
  std::size_t count = 0;

  /// Rays go on past the part to the room; a room surface before the part drops the direction.
  void flush(const RayScene& room, const RoomPatches& patches, const glm::dvec3& x,
             std::vector<OccludedDirection>& out) {
    if (count == 0)
      return;
    RayHits16 hits;
    const RayPacket16 rays = ray_fan(room.to_local(x), count, [&](std::size_t k) { return glm::vec3(direction[k]); });
    const std::uint32_t ends = room.closest16(rays, static_cast<int>(count), hits);
    for (std::size_t k = 0; k < count; ++k) {
      OccludedDirection& c = covered[k];
      if (ends >> k & 1u) {
        const double distance = static_cast<double>(hits.distance[k]);
        if (distance < c.object.distance)
          continue;
        c.position = x + distance * direction[k];
        c.behind = patches.at(hits.triangle[k], c.position, direction[k]);
      }
      out.push_back(c);
    }
    count = 0;
  }
};

} // namespace

/// A low-discrepancy set, shifted by (1/4, 1/4n) from phase to phase (Cranley & Patterson 1976).
DirectionPattern::DirectionPattern(int most, int phase) {
  for (int count = most; std::vector<Point> & points : points_) {
    for (int k = 0; k < count; ++k) {
      const glm::dvec2 u = lattice_point(k, count);
      const double part = static_cast<double>(phase) / kPhases, height = u.x + part - std::floor(u.x + part);
      const double turn = 2.0 * std::numbers::pi * (u.y + part / count);
      points.push_back({height, std::cos(turn), std::sin(turn)});
    }
    count = (count + 1) / 2;
  }
}

namespace {

/// Sixteen directions at a time against the part, and those that meet it, sixteen at a time, against the room: what is
/// behind, or that the room stands before the part. `weight`: of a direction, none where it is not positive.
template <class Weight>
void look_at_part(const RayScene& room, const RoomPatches& patches, const PlacedParts& parts, const SeenFrom& seen,
                  const glm::dvec3& x, const Cone& cone, const DirectionPattern& pattern, const Weight& weight,
                  std::vector<OccludedDirection>& covered) {
  const std::span<const DirectionPattern::Point> points = pattern.points(cone.halvings());
  Candidates candidates;
  std::array<glm::dvec3, kPacket> directions;
  std::array<float, kPacket> weights;
  std::array<PartHit, kPacket> hits;
  for (std::size_t k = 0; k < points.size();) {
    std::size_t count = 0;
    for (; k < points.size() && count < kPacket; ++k)
      if (const glm::dvec3 w = cone.direction(points[k]); (weights[count] = weight(w)) > 0.0f)
        directions[count++] = w;
    const std::span<const glm::dvec3> towards(directions.data(), count);
    const std::uint32_t met = count > 0 ? parts.cast_first(seen.part, x, towards, hits, seen.ignored) : 0u;
    for (std::size_t i = 0; i < count; ++i) {
      if (!(met >> i & 1u))
        continue;
      candidates.direction[candidates.count] = directions[i];
      candidates.covered[candidates.count++] = {hits[i], weights[i] * parts.opacity(seen.part), nullptr,
                                                x + directions[i]};
      if (candidates.count == kPacket)
        candidates.flush(room, patches, x, covered);
    }
  }
  candidates.flush(room, patches, x, covered);
}

} // namespace

void add_patch(std::vector<SeenPatch>& seen, RoomPatch* patch, float weight) {
  auto same = std::ranges::find(seen, patch, &SeenPatch::patch);
  if (same == seen.end())
    same = seen.insert(same, {patch, 0.0f});
  same->weight += weight;
}

namespace {

/// Does the part lie above the horizon of n at x?
bool is_above(const BoundingSphere& sphere, const glm::dvec3& x, const glm::dvec3& n) {
  return sphere.radius > 0.0 && glm::dot(n, sphere.centre - x) >= -sphere.radius;
}

} // namespace

void find_occluded(const RayScene& room, const RoomPatches& patches, const PlacedParts& parts, std::size_t part,
                   const glm::dvec3& x, const glm::dvec3& n, const DirectionPattern& pattern,
                   std::vector<OccludedDirection>& covered) {
  if (!is_above(parts.sphere(part), x, n))
    return;
  const Cone cone(parts.sphere(part), x, n);
  const auto weight = [&](const glm::dvec3& w) {
    const double cosine = glm::dot(n, w);
    return cosine > 0.0 ? cone.weight(cosine, pattern) : 0.0f;
  };
  look_at_part(room, patches, parts, {part, part}, x, cone, pattern, weight, covered);
}

void find_others(const RayScene& room, const RoomPatches& patches, const PlacedParts& parts, std::size_t own,
                 const glm::dvec3& x, const glm::dvec3& n, const VisibleCosine& visible,
                 const DirectionPattern& pattern, std::vector<OccludedDirection>& covered) {
  for (std::size_t part = 0; part < parts.size(); ++part) {
    if (part == own || !is_above(parts.sphere(part), x, n))
      continue;
    const Cone cone(parts.sphere(part), x, n);
    const auto weight = [&](const glm::dvec3& w) {
      const float cosine = visible(glm::vec3(w));
      return cosine > 0.0f ? cone.weight(static_cast<double>(cosine), pattern) : 0.0f;
    };
    look_at_part(room, patches, parts, {part, own}, x, cone, pattern, weight, covered);
  }
}

std::vector<SeenPatch> find_around(const RayScene& room, const RoomPatches& patches, const glm::dvec3& x,
                                   const glm::dvec3& n, const DirectionPattern& pattern) {
  const auto each = static_cast<float>(std::numbers::pi / static_cast<double>(pattern.points().size()));
  std::vector<SeenPatch> seen;
  look_around(room, x, n, pattern, [&](std::uint32_t triangle, const glm::dvec3& position, const glm::dvec3& w) {
    add_patch(seen, patches.at(triangle, position, w), each);
  });
  return seen;
}

/// 1 - cos_max / kWhole of the widest cone.
float surrounded(const PlacedParts& parts, const glm::dvec3& x) {
  double widest = 1.0;
  for (std::size_t part = 0; part < parts.size(); ++part)
    if (parts.sphere(part).radius > 0.0)
      widest = std::min(widest, Cone(parts.sphere(part), x).cos_max);
  return static_cast<float>(std::clamp(1.0 - widest / kWhole, 0.0, 1.0));
}

void find_occluded_by(const RayScene& room, const RoomPatches& patches, const PlacedParts& parts, const SeenFrom& seen,
                      const glm::dvec3& x, const DirectionPattern& pattern, std::vector<OccludedDirection>& covered) {
  const Cone cone(parts.sphere(seen.part), x);
  look_at_part(
      room, patches, parts, seen, x, cone, pattern, [&](const glm::dvec3&) { return cone.weight(1.0, pattern); },
      covered);
}

} // namespace daylit
