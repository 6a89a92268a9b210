#include "runtime/trace/shadow_sums.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include <glm/geometric.hpp>

#include "runtime/base/lane_vector.h"

namespace daylit {

namespace {

std::uint64_t count(std::uint32_t bits) { return static_cast<std::uint64_t>(std::popcount(bits)); }

void aim(RayBlock& rays, const PointBlock& from, float tnear) {
  std::copy(from.x, from.x + kLanes, rays.org_x);
  std::copy(from.y, from.y + kLanes, rays.org_y);
  std::copy(from.z, from.z + kLanes, rays.org_z);
  std::fill(rays.tnear, rays.tnear + kLanes, tnear);
  std::fill(rays.tfar, rays.tfar + kLanes, std::numeric_limits<float>::infinity());
}

void turn(RayBlock& rays, const glm::vec3& w) {
  std::fill(rays.dir_x, rays.dir_x + kLanes, w.x);
  std::fill(rays.dir_y, rays.dir_y + kLanes, w.y);
  std::fill(rays.dir_z, rays.dir_z + kLanes, w.z);
}

/// Adds one light; the bits of `by_room` and `by_both` lose it.
DAYLIT_LANE_CLONES
void add(LaneSums& sums, const Rgb& irradiance, const float (&e)[3][kLanes], std::uint32_t by_room,
         std::uint32_t by_both) {
  for (int c = 0; c < 3; ++c) {
    const float whole = c == 0 ? irradiance.r : c == 1 ? irradiance.g : irradiance.b;
    float *unblocked = sums.unblocked[c], *past_room = sums.past_room[c], *past_both = sums.past_both[c];
    const float* share = e[c];
    DAYLIT_EACH_LANE {
      const float light = whole * share[k];
      unblocked[k] += light;
      past_room[k] += (by_room >> k & 1u) ? 0.0f : light;
      past_both[k] += (by_both >> k & 1u) ? 0.0f : light;
    }
  }
}

float safe_inverse(float d) { return 1.0f / (std::fabs(d) > 1e-12f ? d : std::copysign(1e-12f, d)); }

/// Lanes that face w and whose ray along it meets the casters' box.
DAYLIT_LANE_CLONES
std::uint32_t lanes_near(const PointBlock& p, const glm::vec3& w, const ShadowCasters& casters) {
  const float wx = w.x, wy = w.y, wz = w.z, ix = safe_inverse(wx), iy = safe_inverse(wy), iz = safe_inverse(wz);
  // Sides that a ray along w enters and leaves by.
  const glm::vec3 &lo = casters.low, &hi = casters.high;
  const float in_x = ix > 0 ? lo.x : hi.x, out_x = ix > 0 ? hi.x : lo.x, in_y = iy > 0 ? lo.y : hi.y,
              out_y = iy > 0 ? hi.y : lo.y, in_z = iz > 0 ? lo.z : hi.z, out_z = iz > 0 ? hi.z : lo.z;
  std::uint32_t lanes = 0;
#pragma omp simd reduction(| : lanes)
  for (int k = 0; k < kLanes; ++k) {
    const float ax = (in_x - p.x[k]) * ix, ay = (in_y - p.y[k]) * iy, az = (in_z - p.z[k]) * iz;
    const float bx = (out_x - p.x[k]) * ix, by = (out_y - p.y[k]) * iy, bz = (out_z - p.z[k]) * iz;
    float enter = ax > ay ? ax : ay, leave = bx < by ? bx : by;
    enter = az > enter ? az : enter;
    leave = bz < leave ? bz : leave;
    enter = enter > 0.0f ? enter : 0.0f;
    const float cosine = p.nx[k] * wx + p.ny[k] * wy + p.nz[k] * wz;
    lanes |= ((leave >= enter) & (cosine > 0.0f)) ? 1u << k : 0u;
  }
  return lanes & p.lanes;
}

DAYLIT_LANE_CLONES
std::uint32_t lanes_facing(const PointBlock& p, const glm::vec3& w) {
  const float wx = w.x, wy = w.y, wz = w.z;
  std::uint32_t lanes = 0;
#pragma omp simd reduction(| : lanes)
  for (int k = 0; k < kLanes; ++k)
    lanes |= p.nx[k] * wx + p.ny[k] * wy + p.nz[k] * wz > 0.0f ? 1u << k : 0u;
  return lanes & p.lanes;
}

/// Bits of the directions that n faces, and of those along which a ray from x meets the sphere.
struct Faced {
  std::uint32_t facing = 0, near = 0;
};
DAYLIT_LANE_CLONES
Faced faced(const DirectionBlock& w, const glm::vec3& n, const glm::vec3& to_centre, float radius) {
  const float nx = n.x, ny = n.y, nz = n.z, cx = to_centre.x, cy = to_centre.y, cz = to_centre.z;
  const float distance2 = cx * cx + cy * cy + cz * cz, reach2 = radius * radius;
  std::uint32_t facing = 0, near = 0;
#pragma omp simd reduction(| : facing, near)
  for (int k = 0; k < kLanes; ++k) {
    const float along = cx * w.x[k] + cy * w.y[k] + cz * w.z[k];
    facing |= nx * w.x[k] + ny * w.y[k] + nz * w.z[k] > 0.0f ? 1u << k : 0u;
    near |= ((along > -radius) & (distance2 - along * along < reach2)) ? 1u << k : 0u;
  }
  return {facing, near};
}

bool block_near(const PointBlock& p, const glm::vec3& w, const ShadowCasters& casters) {
  const glm::vec3 d = casters.centre - p.centre;
  const float reach = casters.radius + p.radius, along = glm::dot(d, w);
  return along > -reach && glm::dot(d, d) - along * along < reach * reach;
}

} // namespace

bool may_be_shadowed(const LightCone& cone, const ShadowCasters& casters, const glm::vec3& centre, float radius) {
  if (cone.empty() || casters.radius <= 0.0f)
    return false;
  const glm::vec3 d = casters.centre - centre;
  const float distance = glm::length(d), reach = casters.radius + radius;
  if (distance <= reach)
    return true;
  // cos(half angle + angle of the sphere); wider than a half-space together where the sine is negative.
  const float sine = reach / distance, cosine = std::sqrt(1.0f - sine * sine);
  const bool all_around = cone.sine * cosine + cone.cosine * sine <= 1e-5f;
  return all_around || glm::dot(cone.axis, d) >= distance * (cone.cosine * cosine - cone.sine * sine);
}

void trace_point(const LightGates& lights, const ShadowCasters& casters, const glm::vec3& start,
                 const glm::vec3& normal, PointOf point_of, std::span<LightBits> bits, std::uint64_t& rays) {
  RayBlock block;
  const bool past_room = point_of == PointOf::object && lights.room_may_block_any();
  const float tnear = point_of == PointOf::object ? 0.0f : kOwnSurface_m;
  std::fill(block.org_x, block.org_x + kLanes, start.x);
  std::fill(block.org_y, block.org_y + kLanes, start.y);
  std::fill(block.org_z, block.org_z + kLanes, start.z);
  std::fill(block.tnear, block.tnear + kLanes, tnear);
  std::fill(block.tfar, block.tfar + kLanes, std::numeric_limits<float>::infinity());
  const auto& directions = lights.direction_blocks();
  for (std::size_t g = 0; g < directions.size(); ++g) {
    const std::size_t used = std::min<std::size_t>(kLanes, lights.size() - g * kLanes);
    const Faced f = faced(directions[g], normal, casters.centre - start, casters.radius);
    const std::uint32_t facing = f.facing & ((1u << used) - 1u), asked = facing & f.near;
    std::copy(directions[g].x, directions[g].x + kLanes, block.dir_x);
    std::copy(directions[g].y, directions[g].y + kLanes, block.dir_y);
    std::copy(directions[g].z, directions[g].z + kLanes, block.dir_z);
    rays += count(asked);
    const std::uint32_t blocked = casters.objects->occluded(asked, block);
    const std::uint32_t by_room = past_room ? casters.occluders->occluded(facing & ~blocked, block) : 0u;
    rays += past_room ? count(facing & ~blocked) : 0u;
    bits[g] = {static_cast<std::uint16_t>(facing), static_cast<std::uint16_t>(blocked),
               static_cast<std::uint16_t>(by_room)};
  }
}

Agreement agree(std::span<const std::span<const LightBits>> corners, std::size_t group) {
  if (corners.empty())
    return {};
  std::uint32_t clear = 0xFFFFu, blocked = 0xFFFFu, room_clear = 0xFFFFu, room_blocked = 0xFFFFu;
  for (const std::span<const LightBits> corner : corners) {
    const LightBits b = corner[group];
    clear &= b.facing & ~static_cast<std::uint32_t>(b.blocked);
    blocked &= b.facing & b.blocked;
    room_clear &= b.facing & ~static_cast<std::uint32_t>(b.blocked | b.by_room);
    room_blocked &= b.facing & b.by_room;
  }
  return {static_cast<std::uint16_t>(clear), static_cast<std::uint16_t>(blocked),
          static_cast<std::uint16_t>(room_clear), static_cast<std::uint16_t>(room_blocked)};
}

namespace {

/// The lights that a block of points loses, one after the other.
class BlockedSearch {
public:
  BlockedSearch(const LightGates& lights, const ShadowCasters& casters, const PointBlock& points,
                const PointBlock& starts, float tnear, bool only_near)
      : lights_(lights), casters_(casters), points_(points), only_near_(only_near) {
    aim(block_, starts, tnear);
  }
  /// Lanes that face the light; of these `clear` cannot lose it.
  std::uint32_t facing(std::size_t light, std::uint32_t& clear) const {
    const glm::vec3& w = lights_.direction(light);
    const std::uint32_t all = lanes_facing(points_, w);
    clear = !only_near_ ? 0u : block_near(points_, w, casters_) ? all & ~lanes_near(points_, w, casters_) : all;
    return all;
  }
  /// Of the lanes, those that receive the light with nothing in the way: much cheaper than a ray.
  std::uint32_t received(std::size_t light, std::uint32_t lanes) {
    return lanes ? lanes & lights_.received(light, points_, e_) : 0u;
  }
  std::uint32_t trace(std::size_t light, std::uint32_t lanes, std::uint64_t& rays) {
    if (lanes == 0)
      return 0;
    turn(block_, lights_.direction(light));
    rays += count(lanes);
    return casters_.objects->occluded(lanes, block_);
  }

private:
  const LightGates& lights_;
  const ShadowCasters& casters_;
  const PointBlock& points_;
  bool only_near_;
  RayBlock block_;
  alignas(64) float e_[3][kLanes];
};

void add_entry(BlockedLights& blocked, std::size_t light, std::uint32_t lanes) {
  if (lanes)
    blocked.entries.push_back({static_cast<std::uint32_t>(light), lanes});
  blocked.lanes |= lanes;
}

} // namespace

void find_blocked_lights(const LightGates& lights, const ShadowCasters& casters, const PointBlock& points,
                         const PointBlock& starts, float tnear, bool only_near,
                         std::span<const std::span<const LightBits>> corners, std::span<const Verdict> hints,
                         BlockedLights& blocked, std::uint64_t& rays) {
  blocked.entries.clear();
  blocked.verdicts.resize(lights.size());
  blocked.lanes = 0;
  BlockedSearch search(lights, casters, points, starts, tnear, only_near);
  for (std::size_t j = 0; j < lights.size(); ++j) {
    const Agreement agreed = agree(corners, j / kLanes);
    const std::uint32_t bit = 1u << (j % kLanes);
    Verdict& verdict = blocked.verdicts[j] = hints.empty() ? Verdict{} : hints[j];
    if (agreed.clear & bit)
      continue;
    std::uint32_t clear = 0;
    const std::uint32_t lanes = search.facing(j, clear) & ~clear & ~verdict.clear;
    if (agreed.blocked & bit)
      verdict.blocked = lanes;
    else {
      const std::uint32_t lit = search.received(j, lanes);
      const std::uint32_t lost = (lit & verdict.blocked) | search.trace(j, lit & ~verdict.blocked, rays);
      verdict = {verdict.clear | clear | (lit & ~lost), lost};
    }
    add_entry(blocked, j, verdict.blocked);
  }
}

void LightHints::reset(std::size_t lights) { verdicts_.assign(lights, {}); }

void LightHints::set(int lane, std::span<const LightWord* const> neighbours) {
  if (neighbours.size() < 2)
    return;
  for (std::size_t first = 0; first < verdicts_.size(); first += 64) {
    std::uint64_t clear = ~std::uint64_t{0}, blocked = clear, one = 0, two = 0;
    for (const LightWord* words : neighbours) {
      const LightWord& w = words[first / 64];
      const std::uint64_t known = w.clear | w.blocked;
      two |= one & known;
      one |= known;
      clear &= ~w.blocked;
      blocked &= ~w.clear;
    }
    know(lane, first / 64, {two & clear, two & blocked});
  }
}

void LightHints::know(int lane, std::size_t word, const LightWord& known) {
  Verdict* verdicts = &verdicts_[64 * word];
  for (std::uint64_t left = known.clear; left; left &= left - 1)
    verdicts[std::countr_zero(left)].clear |= 1u << lane;
  for (std::uint64_t left = known.blocked; left; left &= left - 1)
    verdicts[std::countr_zero(left)].blocked |= 1u << lane;
}

namespace {

/// Bits of up to 64 lights, for all lanes at once.
DAYLIT_LANE_CLONES
void turn_bits(const Verdict* verdicts, std::size_t count, std::uint64_t* clear, std::uint64_t* blocked) {
  for (std::size_t j = 0; j < count; ++j) {
    const std::uint64_t c = verdicts[j].clear, b = verdicts[j].blocked;
    DAYLIT_EACH_LANE {
      clear[k] |= (c >> k & 1u) << j;
      blocked[k] |= (b >> k & 1u) << j;
    }
  }
}

} // namespace

void note_verdicts(const BlockedLights& blocked, std::span<LightWord* const> words) {
  for (std::size_t first = 0; first < blocked.verdicts.size(); first += 64) {
    alignas(64) std::uint64_t clear[kLanes] = {}, taken[kLanes] = {};
    turn_bits(&blocked.verdicts[first], std::min<std::size_t>(64, blocked.verdicts.size() - first), clear, taken);
    for (std::size_t k = 0; k < words.size(); ++k)
      words[k][first / 64] = {clear[k], taken[k]};
  }
}

void sum_lights(const LightGates& lights, const BlockedLights& blocked, const ShadowCasters& casters,
                const PointBlock& points, const PointBlock& starts, float tnear, RoomShadow room_shadow,
                std::span<const std::span<const LightBits>> corners, LaneSums& sums, std::uint64_t& rays) {
  RayBlock block;
  const bool on_objects = room_shadow == RoomShadow::on_objects;
  const bool room_blocks = on_objects ? lights.room_may_block_any() : !casters.occluders->empty();
  if (room_blocks)
    aim(block, starts, tnear);
  alignas(64) float e[3][kLanes];
  Agreement agreed;
  auto next = blocked.entries.begin();
  for (std::size_t j = 0; j < lights.size(); ++j) {
    if (j % kLanes == 0 && room_blocks)
      agreed = agree(corners, j / kLanes);
    const bool listed = next != blocked.entries.end() && next->light == j;
    const std::uint32_t behind = listed ? (next++)->lanes : 0u;
    const std::uint32_t lit = lights.received(j, points, e);
    if (lit == 0)
      continue;
    const std::uint32_t bit = 1u << (j % kLanes);
    std::uint32_t asked = lit & (room_shadow == RoomShadow::where_blocked ? behind : ~0u), by_room = 0;
    if (on_objects && !lights.room_may_block(j))
      asked = 0;
    if (agreed.room_blocked & bit)
      by_room = asked;
    else if (asked && room_blocks && !(agreed.room_clear & bit)) {
      turn(block, lights.direction(j));
      by_room = casters.occluders->occluded(asked, block);
      rays += count(asked);
    }
    add(sums, lights.irradiance(j), e, by_room, by_room | behind);
  }
}

} // namespace daylit
