#include "runtime/indirect/window_shares.h"

#include <algorithm>
#include <map>
#include <numbers>

#include "runtime/base/cell_key.h"
#include "runtime/indirect/lit_side.h"
#include "runtime/object/received_light.h"

namespace daylit {

namespace {

using SeenPoints = WindowVisibility::SeenPoints;
constexpr double kWindowCell = 0.1;   // of an object's radius: a cube of that side sees windows alike
constexpr float kLeastHidden = 1e-3f; // from there on an object's own shadow is looked for

/// What of the windows is seen from cubes of space around the senders.
struct WindowCells {
  std::vector<std::uint32_t> of;               ///< per sender
  std::vector<SeenPoints> past_room, past_all; ///< past_all: past other objects, too; empty where these are far away
};

/// Of those in one cube from the first of them. What lies on a surface looks from above it.
WindowCells window_cells(const WindowVisibility& windows, const IndirectShadow* others, const VirtualObjects& objects) {
  WindowCells cells;
  cells.of.resize(objects.senders.vertex.size());
  std::vector<glm::dvec3> eye;
  std::vector<std::size_t> part_of;
  for (std::size_t k = 0; k < objects.parts.size(); ++k) {
    std::map<CellKey, std::uint32_t> known;
    const auto [first, last] = of_part(objects.parts[k], objects.senders.vertex);
    const double side = std::max(kWindowCell * objects.parts[k].sphere.radius, 1e-6);
    for (std::size_t i = first; i < last; ++i) {
      const glm::dvec3& x = objects.senders.surface.positions[i];
      const auto [found, made] = known.emplace(CellKey(x, side), static_cast<std::uint32_t>(eye.size()));
      if (made)
        eye.push_back(x + kAirGap_m * (glm::dvec3(objects.senders.surface.normals[i]) + glm::dvec3(0.0, 0.0, 2.0)));
      cells.of[i] = found->second;
    }
    part_of.resize(eye.size(), k);
  }
  cells.past_room.resize(eye.size());
  cells.past_all.resize(others && others->objects_see_each_other() ? eye.size() : 0);
  parallel_for(std::size_t{0}, eye.size(), [&](std::size_t k) {
    cells.past_room[k] = windows.seen_points(eye[k]);
    if (!cells.past_all.empty())
      cells.past_all[k] = others->not_hidden(part_of[k], eye[k], cells.past_room[k]);
  });
  return cells;
}

/// Of the windows' light what reaches a side from the points that are seen from its cell, past its own object.
float share_of(const WindowVisibility& windows, const LitSide& side, const SeenPoints& from_cell) {
  const bool hides = hidden_fraction(side.transfer()) >= kLeastHidden;
  return windows.visible_fraction(side.position(), side.normal(),
                                  hides ? windows.past_own(side.position(), from_cell, side.seen()) : from_cell);
}

} // namespace

ContactViews contact_views(const IndirectShadow& field, const VirtualObjects& objects) {
  if (!field.objects_see_each_other())
    return {};
  ContactViews views(objects.senders.vertex.size());
  for_each_side(objects, [&](const LitSide& side) {
    views[side.number][side.back] = field.contact_view(side.part, side.position(), side.seen());
  });
  return views;
}

/// Nearer to another object than its views tell, what this hides is wanted of each vertex: of what comes past the room
/// it takes `blocked`, of what comes past the sender's own object as much in proportion.
WindowShares window_shares(const WindowVisibility& windows, const IndirectShadow* others, const VirtualObjects& objects,
                           const ContactViews& views) {
  const WindowCells cells = window_cells(windows, others, objects);
  WindowShares shares(cells.of.size());
  for_each_side(objects, [&](const LitSide& side) {
    const SeenPoints& past_room = cells.past_room[cells.of[side.number]];
    float& share = shares[side.number][side.back];
    if (views.empty()) {
      share = share_of(windows, side, past_room);
      return;
    }
    const ContactView& view = views[side.number][side.back];
    share =
        view.share < 1.0f ? (1.0f - view.share) * share_of(windows, side, cells.past_all[cells.of[side.number]]) : 0.0f;
    if (view.share > 0.0f)
      if (const float open = windows.visible_fraction(side.position(), side.normal(), past_room); open > view.blocked)
        share += view.share * (1.0f - view.blocked / open) * share_of(windows, side, past_room);
  });
  return shares;
}

/// L = rho / pi V E(n): E of the lights without shadow.
std::vector<TwoSided> direct_radiance(std::span<const DirectionalLight> windows, const VirtualObjects& objects,
                                      const WindowShares& shares) {
  const ReceivedLight received(windows);
  std::vector<TwoSided> radiance(shares.size());
  for_each_side(objects, [&](const LitSide& side) {
    side.of(radiance) = std::numbers::inv_pi_v<float> * shares[side.number][side.back] *
                        objects.senders.surface.reflectance[side.number] *
                        received.irradiance(glm::vec3(side.normal()));
  });
  return radiance;
}

} // namespace daylit
