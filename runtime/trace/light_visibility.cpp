#include "runtime/trace/light_visibility.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

#include "scene/core/orthonormal.h"

namespace daylit {

namespace {

/// The disc of the given radius around the origin and the triangle share a point: an edge passes within the radius, or
/// the origin lies on the same side of all edges.
bool disc_meets_triangle(const std::array<glm::vec2, 3>& p, float radius) {
  int left = 0, right = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const glm::vec2 &a = p[k], d = p[(k + 1) % 3] - a;
    const float length2 = glm::dot(d, d), t = length2 > 0.0f ? std::clamp(-glm::dot(a, d) / length2, 0.0f, 1.0f) : 0.0f;
    const glm::vec2 nearest = a + t * d;
    if (glm::dot(nearest, nearest) <= radius * radius)
      return true;
    const float side = a.x * d.y - a.y * d.x;
    left += side > 0.0f;
    right += side < 0.0f;
  }
  return left == 3 || right == 3;
}

std::uint64_t count(LaneMask lanes) { return static_cast<std::uint64_t>(std::popcount(lanes)); }

void aim(RayPacket16& rays, const PointBlock& from, float tnear = 0.0f) {
  std::copy(from.x, from.x + kLanes, rays.org_x);
  std::copy(from.y, from.y + kLanes, rays.org_y);
  std::copy(from.z, from.z + kLanes, rays.org_z);
  std::fill(rays.tnear, rays.tnear + kLanes, tnear);
  std::fill(rays.tfar, rays.tfar + kLanes, std::numeric_limits<float>::infinity());
}

void aim(RayPacket16& rays, const glm::vec3& from) {
  PointBlock same;
  for (int k = 0; k < kLanes; ++k)
    same.set(k, from, glm::vec3(0.0f));
  aim(rays, same);
}

void turn(RayPacket16& rays, const glm::vec3& w) {
  std::fill(rays.dir_x, rays.dir_x + kLanes, w.x);
  std::fill(rays.dir_y, rays.dir_y + kLanes, w.y);
  std::fill(rays.dir_z, rays.dir_z + kLanes, w.z);
}

/// Whether a ray along w from a sphere around the points may meet the casters' sphere.
bool block_is_near(const PointBlock& p, const glm::vec3& w, const ShadowCasters& casters) {
  const glm::vec3 d = casters.centre - p.centre;
  const float both = casters.radius + p.radius, along = glm::dot(d, w);
  return along > -both && glm::dot(d, d) - along * along < both * both;
}

/// The lights that a block of points loses, one after the other.
class BlockedSearch {
public:
  BlockedSearch(const TracedLights& lights, const ShadowCasters& casters, Layer layer, const PointBlock& points,
                const RayStarts& starts)
      : lights_(lights.portal), casters_(casters), points_(points), starts_(starts), layer_(layer) {
    aim(block_, starts.of(0));
  }
  /// Lanes that face the light. `clear`: of these, points of the room whose rays miss the objects' box.
  LaneMask facing(std::size_t light, LaneMask& clear) const {
    const glm::vec3& w = lights_.direction(light);
    const LaneMask all = lanes::facing(points_, w);
    clear = 0;
    if (const PointBlock& from = starts_.of(light); layer_ == Layer::room)
      clear = block_is_near(from, w, casters_) ? all & ~lanes::facing_through_box(from, w, casters_.low, casters_.high)
                                               : all;
    return all;
  }
  /// Of the lanes, those that receive the light with nothing in the way: much cheaper than a ray.
  LaneMask received(std::size_t light, LaneMask lanes) {
    return lanes ? lanes & lights_.received(light, points_, e_) : 0u;
  }
  LaneMask trace(std::size_t light, LaneMask lanes, std::uint64_t& rays) {
    if (lanes == 0)
      return 0;
    point_at(light);
    rays += count(lanes);
    return casters_.opaque->occluded(lanes, block_);
  }
  /// Of the lanes, those whose light goes through glass; the part that is left is added to `blocked`.
  LaneMask pass_glass(std::size_t light, LaneMask lanes, BlockedLights& blocked, std::uint64_t& rays) {
    if (!casters_.glass || lanes == 0)
      return 0;
    point_at(light);
    rays += count(lanes);
    LaneRgb left;
    const LaneMask weakened = casters_.glass->pass(lanes, block_, left);
    if (weakened)
      blocked.left.push_back(left);
    return weakened;
  }

private:
  void point_at(std::size_t light) {
    if (starts_.differ())
      aim(block_, starts_.of(light));
    turn(block_, lights_.direction(light));
  }
  const PortalLights& lights_;
  const ShadowCasters& casters_;
  const PointBlock& points_;
  const RayStarts& starts_;
  Layer layer_;
  RayPacket16 block_;
  LaneRgb e_;
};

/// Counts from 0; anything where there is none.
std::uint32_t last_of(const std::vector<LaneRgb>& values) { return static_cast<std::uint32_t>(values.size()) - 1u; }

/// Adds irradiance x e, and behind glass what is left of it.
void add_past(const BlockedLights::Entry& taken, std::span<const LaneRgb> left, LaneMask by_room, const Rgb& irradiance,
              const LaneRgb& e, lanes::LightSums& sums) {
  lanes::add_light(sums, irradiance, e, by_room, by_room | taken.lanes | taken.weakened);
  for (LaneMask lanes = taken.weakened & ~by_room; lanes; lanes &= lanes - 1) {
    const int k = std::countr_zero(lanes);
    for (int c = 0; c < 3; ++c)
      sums.past_both.channel[c][k] += irradiance[c] * e.channel[c][k] * left[taken.left].channel[c][k];
  }
}

} // namespace

ShadowBounds::ShadowBounds(std::span<const glm::vec3> vertices,
                           std::span<const std::array<std::uint32_t, 3>> triangles) {
  for (const auto& t : triangles) {
    const glm::vec3 &a = vertices[t[0]], &b = vertices[t[1]], &c = vertices[t[2]];
    const glm::vec3 lo = glm::min(a, glm::min(b, c)), hi = glm::max(a, glm::max(b, c));
    triangles_.push_back({{a, b, c}, 0.5f * (lo + hi), 0.5001f * glm::length(hi - lo)});
  }
}

/// The rays fill a half-infinite cylinder with a round end. A sphere around the triangle at d meets it when its
/// distance from the axis, sqrt(d.d - (d.w)^2), is at most the sum of the radii and it does not lie wholly behind the
/// end; what is left is decided across the axis.
bool ShadowBounds::may_block(const glm::vec3& w, const glm::vec3& centre, float radius) const {
  const OrthonormalBasis basis{glm::dvec3(w)};
  const glm::vec3 u(basis.u), v(basis.v);
  return std::ranges::any_of(triangles_, [&](const Triangle& t) {
    const glm::vec3 d = t.centre - centre;
    const float along = glm::dot(d, w), both = radius + t.radius;
    if (along < -both || glm::dot(d, d) - along * along > both * both)
      return false;
    std::array<glm::vec2, 3> across;
    bool ahead = false;
    for (std::size_t k = 0; k < 3; ++k) {
      const glm::vec3 p = t.corners[k] - centre;
      across[k] = {glm::dot(p, u), glm::dot(p, v)};
      ahead = ahead || glm::dot(p, w) > -radius;
    }
    return ahead && disc_meets_triangle(across, radius);
  });
}

void TracedLights::find_room_shadows(const ShadowBounds& room, const glm::vec3& centre, float radius) {
  room_may_block.resize(size());
  room_may_block_any = false;
  for (std::size_t j = 0; j < size(); ++j) {
    room_may_block[j] = room.may_block(portal.direction(j), centre, radius);
    room_may_block_any = room_may_block_any || room_may_block[j];
  }
}

/// Two cones around the point of directions: that of the lights, and that of the objects' sphere, whose half angle has
/// the sine r / d. They are apart where the angle between the axes exceeds the sum of the half angles.
bool may_be_shadowed(const LightCone& cone, const ShadowCasters& casters, const glm::vec3& centre, float radius) {
  if (cone.empty() || casters.radius <= 0.0f)
    return false;
  const glm::vec3 d = casters.centre - centre;
  const float distance = glm::length(d), both = casters.radius + radius;
  if (distance <= both)
    return true;
  // cos(half angle + angle of the sphere); wider than a half-space together where the sine is negative.
  const float sine = both / distance, cosine = std::sqrt(1.0f - sine * sine);
  const bool all_around = cone.sine * cosine + cone.cosine * sine <= 1e-5f;
  return all_around || glm::dot(cone.axis, d) >= distance * (cone.cosine * cosine - cone.sine * sine);
}

std::uint64_t see_point(const TracedLights& lights, const ShadowCasters& casters, Layer layer, const PixelSurface& at,
                        std::span<KnownLights> objects, std::span<KnownLights> room) {
  std::ranges::fill(objects, KnownLights{});
  std::ranges::fill(room, KnownLights{});
  const bool past_room = layer == Layer::object && lights.room_may_block_any;
  RayPacket16 block;
  aim(block, at.start);
  std::uint64_t rays = 0;
  const auto directions = lights.portal.direction_blocks();
  for (std::size_t g = 0; g < directions.size(); ++g) {
    const std::size_t first = g * kLanes, used = std::min<std::size_t>(kLanes, lights.size() - first);
    const lanes::FacedLights f =
        lanes::faced_lights(directions[g], at.normal, casters.centre - at.start, casters.radius);
    const LaneMask facing = f.facing & ((1u << used) - 1u), near = facing & f.through_sphere;
    std::copy(directions[g].x, directions[g].x + kLanes, block.dir_x);
    std::copy(directions[g].y, directions[g].y + kLanes, block.dir_y);
    std::copy(directions[g].z, directions[g].z + kLanes, block.dir_z);
    const LaneMask blocked = casters.opaque->occluded(near, block);
    const LaneMask left = facing & ~blocked;
    const LaneMask weakened = casters.glass ? casters.glass->meets(near & ~blocked, block) : 0u;
    const LaneMask by_room = past_room ? casters.occluders->occluded(left, block) : 0u;
    rays += count(near) + (casters.glass ? count(near & ~blocked) : 0u) + (past_room ? count(left) : 0u);
    const std::size_t word = first / kLightsPerWord, shift = first % kLightsPerWord;
    objects[word].clear |= std::uint64_t{left} << shift;
    objects[word].blocked |= std::uint64_t{blocked | weakened} << shift;
    room[word].clear |= std::uint64_t{left & ~by_room} << shift;
    room[word].blocked |= std::uint64_t{by_room} << shift;
  }
  return rays;
}

std::uint64_t find_blocked_lights(const TracedLights& lights, const ShadowCasters& casters, Layer layer,
                                  const PointBlock& points, const RayStarts& starts, std::span<const LaneVerdict> hints,
                                  BlockedLights& blocked) {
  blocked.entries.clear();
  blocked.left.clear();
  blocked.verdicts.resize(lights.size());
  blocked.lanes = 0;
  BlockedSearch search(lights, casters, layer, points, starts);
  std::uint64_t rays = 0;
  for (std::size_t j = 0; j < lights.size(); ++j) {
    LaneVerdict& verdict = blocked.verdicts[j] = hints.empty() ? LaneVerdict{} : hints[j];
    if ((points.lanes & ~verdict.clear) == 0)
      continue;
    LaneMask clear = 0;
    const LaneMask lanes = search.facing(j, clear) & ~clear & ~verdict.clear;
    const LaneMask lit = search.received(j, lanes);
    const LaneMask lost = (lit & verdict.blocked) | search.trace(j, lit & ~verdict.blocked, rays);
    const LaneMask weakened = search.pass_glass(j, lit & ~lost, blocked, rays);
    verdict = {verdict.clear | clear | (lit & ~lost), lost | weakened};
    if (lost | weakened)
      blocked.entries.push_back({static_cast<std::uint32_t>(j), lost, weakened, last_of(blocked.left)});
    blocked.lanes |= lost | weakened;
  }
  return rays;
}

std::uint64_t sum_lights(const TracedLights& lights, const BlockedLights& blocked, const ShadowCasters& casters,
                         Layer layer, const PointBlock& points, const RayStarts& starts,
                         std::span<const LaneVerdict> room_hints, lanes::LightSums& sums) {
  const bool on_objects = layer == Layer::object;
  const bool room_blocks = on_objects ? lights.room_may_block_any : !casters.occluders->empty();
  RayPacket16 block;
  const float own_surface = on_objects ? 0.0f : kOwnSurface_m;
  if (room_blocks)
    aim(block, starts.of(0), own_surface);
  LaneRgb e;
  std::uint64_t rays = 0;
  auto next = blocked.entries.begin();
  for (std::size_t j = 0; j < lights.size(); ++j) {
    const bool listed = next != blocked.entries.end() && next->light == j;
    const BlockedLights::Entry taken = listed ? *next++ : BlockedLights::Entry{};
    const LaneMask lit = lights.portal.received(j, points, e);
    if (lit == 0)
      continue;
    const LaneMask wanted = room_blocks && (!on_objects || lights.room_may_block[j]) ? lit : 0u;
    const LaneVerdict known = room_hints.empty() ? LaneVerdict{} : room_hints[j];
    LaneMask by_room = wanted & known.blocked;
    if (const LaneMask asked = wanted & ~known.clear & ~known.blocked; asked) {
      if (starts.differ())
        aim(block, starts.of(j), own_surface);
      turn(block, lights.portal.direction(j));
      by_room |= casters.occluders->occluded(asked, block);
      rays += count(asked);
    }
    add_past(taken, blocked.left, by_room, lights.portal.irradiance(j), e, sums);
  }
  return rays;
}

} // namespace daylit
