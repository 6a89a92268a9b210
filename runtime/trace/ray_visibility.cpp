#include "runtime/trace/ray_visibility.h"

#include <glm/geometric.hpp>

#include "runtime/trace/surface_points.h"

namespace daylit {

namespace {
constexpr float kContact_px = 32.0f; // an object nearer than eight blocks casts a shadow as narrow as one
}

PixelSurface RayVisibility::surface(Layer layer, int x, int y, bool beside_outline) const {
  const ObjectHit& hit = view_.object(x, y);
  if (layer == Layer::object)
    return view_.is_outline(x, y) || hit.samples == 0 || scene_.is_black(hit.triangle)
               ? PixelSurface{}
               : object_surface(scene_, view_.eye(), hit);
  const RoomHit room = view_.room(x, y);
  if (room.triangle == kNoTriangle || (hit.samples > 0 && !beside_outline))
    return {};
  const std::size_t block =
      static_cast<std::size_t>(y / kBlockSide) * view_.block_columns() + static_cast<std::size_t>(x / kBlockSide);
  PixelSurface surface = room_surface(
      scene_, view_.eye(), room.triangle,
      view_.eye() + room.depth * view_.direction(static_cast<float>(x), static_cast<float>(y)), receives_[block] != 0);
  const float gap =
      (room.depth - hit.depth) * glm::length(view_.direction(static_cast<float>(x), static_cast<float>(y)));
  surface.hidden = hit.samples > 0 && view_.radius_px(surface.position, gap) < kContact_px;
  return surface;
}

/// Fraction = sum over lights of e V / sum of e (runtime/sky/direct_light.h); 1 where no light arrives. Where no light
/// is blocked nothing is lost, and the sums are not needed.
std::uint64_t RayVisibility::see_sky(Layer layer, PointSet& set) const {
  const RayStarts starts(layer == Layer::object ? set.starts : set.points);
  std::uint64_t rays =
      find_blocked_lights(scene_.sky, casters_, layer, set.points, starts, set.hints.verdicts(), set.blocked);
  for (SkyFractions& s : set.sky)
    s = {};
  if (set.blocked.lanes == 0 && (layer == Layer::room || !scene_.sky.room_may_block_any))
    return rays;
  lanes::LightSums sums;
  rays += sum_lights(scene_.sky, set.blocked, casters_, layer, set.points, starts, {}, sums);
  for (int k = 0; k < kLanes; ++k)
    for (int c = 0; c < 3; ++c)
      if (const float whole = sums.unblocked.channel[c][k]; whole > 0.0f) {
        set.sky[k].past_room[c] = sums.past_room.channel[c][k] / whole;
        set.sky[k].past_both[c] = sums.past_both.channel[c][k] / whole;
      }
  return rays;
}

std::uint64_t RayVisibility::see_sun(Layer layer, const PixelSurface& at, std::span<KnownLights> objects,
                                     std::span<KnownLights> room) const {
  return see_point(scene_.sun, casters_, layer, at, objects, room);
}

} // namespace daylit
