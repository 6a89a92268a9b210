// What is known at a node of the lattice, each value found when it is first asked for.

#include <algorithm>
#include <numbers>
#include <utility>

#include "runtime/base/once.h"
#include "runtime/indirect/receiver_state.h"
#include "scene/image/rgb_image.h"

namespace daylit {

namespace {
constexpr float kLeastLoss = 0.005f; // of the light, from which on it is compared with what is around
} // namespace

/// Traced anew when an object moved; what is behind the objects anew under another sky.
void ReceiverLattice::State::renew(Node& node) const {
  if (const auto since = std::exchange(node.placement_version, placement_version); since != placement_version) {
    const glm::dvec3 air = node.x + kAirGap_m * node.n;
    scene.trace(air, node.n, *node.pattern, node.receiver,
                [&](std::size_t part) { return placements.holds(part, air, since); });
    node.sky_version = node.mirrored_version = 0;
  }
  if (std::exchange(node.sky_version, sky_version) != sky_version) {
    // Nodes of narrow cells share the blocks that the shadows on the room need anyway.
    node.here =
        node.cell_m < kRoomLightCell_m ? scene.light.at_surface(node.triangle, node.x, -node.n) : current_light(node);
    node.hidden = scene.hidden_irradiance(node.receiver, node.here, node.x, node.n);
    node.before = LitScene::before(node.receiver, node.here);
  }
  if (std::exchange(node.mirrored_version, mirrored_version) != mirrored_version)
    node.mirrored = scene.mirrored_irradiance(node.receiver);
  const Rgb gain = scene.sent_irradiance(node.receiver) + node.mirrored;
  node.change = {gain - node.hidden, node.before};
  const Rgb scale = scene.gain_scale(gain, node.before, node.here, node.x, node.n, *node.pattern, node.receiver);
  node.rescaled = (scale - 1.0f) * (gain - (1.0f - node.receiver.surrounded) * node.hidden);
}

const IndirectChange& ReceiverLattice::State::current(Node& node) const {
  once(node.light_version, light_version, node.renewing, [&] { renew(node); });
  return node.change;
}

/// Delta E - V_blocked E_sky - E_sun lost.
Rgb ReceiverLattice::State::whole_change(Node& node, bool sun_too) const {
  const Rgb first = current(node).irradiance; // renews node.here
  const Rgb but_sun = first - current_blocked(node) * node.here.open_sky_irradiance;
  if (!sun_too)
    return but_sun;
  once(node.lost_version, (placement_version << 32) + sky_version, node.renewing,
       [&] { node.lost_sun = scene.lost_sun(node.x, node.n, node.cell_m); });
  return but_sun - node.lost_sun;
}

float ReceiverLattice::covered(const Node& node) {
  float sum = 0.0f;
  for (const Receiver::View& view : node.receiver.views)
    for (const Receiver::Sender& s : view.senders)
      sum += s.weight;
  return std::min(sum * std::numbers::inv_pi_v<float>, 1.0f);
}

std::vector<ChangedSurface> ReceiverLattice::State::changed_surfaces(const glm::dvec3& air, const glm::dvec3& n,
                                                                     const DirectionPattern& pattern) const {
  return find_changed_surfaces(scene, air, n, pattern,
                               [this](auto triangle, const auto& x, const auto& direction, double radii_away) {
                                 return link({triangle, scene.facing_of(triangle, direction), x}, radii_away);
                               });
}

/// Delta E' E / E', Delta E' = sum over the surfaces of rho / pi cos dw of Delta E there, E' of all light by the same
/// rays: what they miss of a sun patch, or see too much of, is in both.
Rgb ReceiverLattice::State::reflected_change(std::span<const ChangedSurface> surfaces, const glm::dvec3& air,
                                             const glm::dvec3& n, const DirectionPattern& pattern,
                                             const RoomPoint& here) const {
  Rgb sum(0.0f);
  for (const ChangedSurface& s : surfaces)
    for (std::size_t k = 0; k < 4; ++k)
      if (s.link.weight[k] > 0.0f)
        sum += s.weight * s.link.weight[k] * whole_change(*s.link.node[k]);
  if (!scene.windows.has_sun() || luminance(sum) > -kLeastLoss * luminance(here.indirect_irradiance))
    return sum;
  return agreement(here.indirect_irradiance, scene.sent_by_room(air, n, pattern)) * sum;
}

const Rgb& ReceiverLattice::State::reflected(Node& node) const {
  once(node.reflected_version, light_version, node.reflecting, [&] {
    const glm::dvec3 air = node.x + kAirGap_m * node.n;
    if (std::exchange(node.around_version, placement_version) != placement_version) {
      node.around = changed_surfaces(air, node.n, *node.pattern);
      node.lamps = look_at_lamps(scene, air, node.n, lamp_pattern);
    }
    node.reflected =
        reflected_change(node.around, air, node.n, *node.pattern, node.here) + LampLight::irradiance(node.lamps);
  });
  return node.reflected;
}

float ReceiverLattice::State::current_distance(Node& node) const {
  once(node.distance_version, placement_version, node.renewing, [&] {
    const double radius = lattices[0].cell_m / kLevels[0].cell;
    node.distance = static_cast<float>(scene.parts.distance(node.x, node.farthest * radius) / radius);
  });
  return node.distance;
}

const Rgb& ReceiverLattice::State::current_blocked(Node& node) const {
  once(node.blocked_version, placement_version, node.renewing, [&] {
    const glm::dvec3 air = node.x + kAirGap_m * node.n;
    node.blocked = scene.windows.blocked_fraction(air, node.n, scene.parts) +
                   scene.windows.kept_by_glass(air, node.n, scene.parts);
  });
  return node.blocked;
}

const RoomPoint& ReceiverLattice::State::current_light(Node& node) const {
  return lit.light(node.open, node.triangle, node.x, node.n);
}

float ReceiverLattice::State::window_visibility(Node& node) const {
  once(node.visible_version, 1, node.renewing,
       [&] { node.visible = scene.windows.visible_fraction(node.x + kAirGap_m * node.n, node.n); });
  return node.visible;
}

} // namespace daylit
