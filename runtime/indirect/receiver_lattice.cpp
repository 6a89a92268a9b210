#include "runtime/indirect/receiver_lattice.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "runtime/indirect/receiver_state.h"
#include "scene/image/rgb_image.h"

namespace daylit {

namespace {
constexpr float kLeastWeight = 0.02f; // of the corners in view
} // namespace

/// Two threads may make it: one of the two is kept.
ReceiverLattice::Node* ReceiverLattice::State::node(std::size_t level, const LatticeKey& key,
                                                    std::uint32_t triangle) const {
  const Lattice& lattice = lattices[level];
  if (const auto found = lattice.nodes.find(key); found != lattice.nodes.end())
    return found->second.get();
  auto made = std::make_unique<Node>();
  const RoomFacing& f = scene.planes[key.facing];
  made->number = nodes_made++;
  made->triangle = triangle;
  made->x = f.corner(key.i, key.j, lattice.cell_m);
  made->n = f.normal;
  made->cell_m = lattice.cell_m;
  made->farthest = farthest(level);
  // The corners of a fine cell have all four; wide cells are seen one by one, and have no steps between them.
  const auto phase = level < kContactLevels ? static_cast<std::size_t>((key.i & 1) + 2 * (key.j & 1)) : 0;
  made->pattern = &lattice.patterns[phase];
  return lattice.nodes.emplace(key, std::move(made)).first->second.get();
}

/// Made when first looked up.
const ReceiverCell& ReceiverLattice::State::cell(std::size_t level, const LatticeKey& key,
                                                 std::uint32_t triangle) const {
  const Lattice& lattice = lattices[level];
  if (const auto found = lattice.cells.find(key); found != lattice.cells.end())
    return *found->second;
  auto made = std::make_unique<ReceiverCell>();
  std::array<glm::dvec3, 4> air;
  for (int k = 0; k < 4; ++k) {
    Node* corner = node(level, {key.i + (k & 1), key.j + (k >> 1), key.facing}, triangle);
    air[static_cast<std::size_t>(k)] = corner->x + kAirGap_m * corner->n;
    made->corner[static_cast<std::size_t>(k)] = corner;
  }
  made->open = see_each_other(scene.rays, air);
  return *lattice.cells.emplace(key, std::move(made)).first->second;
}

ReceiverLattice::State::Found ReceiverLattice::State::find(std::size_t level, const Place& place) const {
  const LatticeSquare square = scene.planes[place.facing].square(place.x, lattices[level].cell_m);
  return {&cell(level, {square.i, square.j, place.facing}, place.triangle), square, 0.0};
}

double ReceiverLattice::State::distance(const Found& found) const {
  double sum = 0.0;
  for (std::size_t k = 0; k < 4; ++k)
    sum += static_cast<double>(found.square.weight[k] * current_distance(*found.cell->corner[k]));
  return sum;
}

/// Bilinear; corners that the point does not see count nothing. An object's surface can pass between them only where it
/// is nearer than the cell is wide.
std::array<float, 4> ReceiverLattice::State::weights(std::size_t level, const Found& found, const Place& place) const {
  const glm::dvec3 gap = kAirGap_m * scene.planes[place.facing].normal, air = place.x + gap;
  const bool touched = level < kContactLevels && found.distance < 2.0 * kLevels[level].cell;
  if (found.cell->open && !touched)
    return found.square.weight;
  std::array<float, 4> weight{};
  for (std::size_t k = 0; k < 4; ++k) {
    const glm::dvec3 there = found.cell->corner[k]->x + gap;
    // A corner on a wall is not in view: a little beyond it is the wall. `gap`: of the point itself there is no way.
    const glm::dvec3 beyond = there + kAirGap_m * glm::normalize(there - air + kAirGap_m * gap);
    const bool seen =
        (found.cell->open || scene.windows.visible(air, beyond)) && (!touched || !scene.parts.between(air, there));
    weight[k] = seen ? found.square.weight[k] : 0.0f;
  }
  return weight;
}

/// The cell; of contact levels, whose corners trace four patterns of directions in turn, the four cells around, each
/// with the mean of its corners: all patterns count the same everywhere, and no single direction that meets something
/// bright shows as a dot (Keller and Heidrich 2001).
std::array<ReceiverLattice::State::Found, 4> ReceiverLattice::State::around(std::size_t level, const Found& found,
                                                                            const Place& place,
                                                                            std::array<float, 4>& share) const {
  share = {1.0f, 0.0f, 0.0f, 0.0f};
  std::array<Found, 4> cells{found};
  if (level >= kContactLevels)
    return cells;
  const std::array<float, 4>& w = found.square.weight;
  const glm::vec2 t(w[1] + w[3], w[2] + w[3]); // between the corners; between the middles of the cells around:
  const glm::ivec2 first(t.x < 0.5f ? -1 : 0, t.y < 0.5f ? -1 : 0);
  const glm::vec2 u = t - glm::vec2(first) - 0.5f;
  for (int k = 0; k < 4; ++k) {
    const LatticeKey key{found.square.i + first.x + (k & 1), found.square.j + first.y + (k >> 1), place.facing};
    const auto c = static_cast<std::size_t>(k);
    cells[c] = {&cell(level, key, place.triangle), {key.i, key.j, {0.25f, 0.25f, 0.25f, 0.25f}}, found.distance};
    share[c] = (k & 1 ? u.x : 1.0f - u.x) * (k >> 1 ? u.y : 1.0f - u.y);
  }
  return cells;
}

/// Empty where none of the corners sees x.
std::optional<IndirectChange> ReceiverLattice::State::between_nodes(std::size_t level, const Found& found,
                                                                    const Place& place) const {
  std::array<float, 4> share;
  const std::array<Found, 4> cells = around(level, found, place, share);
  IndirectChange sum;
  float whole = 0.0f;
  for (std::size_t c = 0; c < 4 && cells[c].cell; ++c) {
    const std::array<float, 4> weight = weights(level, cells[c], place);
    for (std::size_t k = 0; k < 4; ++k) {
      const float w = share[c] * weight[k];
      if (w == 0.0f)
        continue;
      Node& node = *cells[c].cell->corner[k];
      const IndirectChange& change = current(node);
      sum.irradiance += w * (change.irradiance + node.rescaled + reflected(node));
      sum.before += w * change.before;
      whole += w;
    }
  }
  if (whole < kLeastWeight)
    return std::nullopt;
  return IndirectChange{sum.irradiance / whole, sum.before / whole};
}

/// Near objects the distance is first taken from wide cells, then, where these are too wide for it, from finer ones.
ReceiverLattice::State::Mix ReceiverLattice::State::mix_at(const Place& place) const {
  const double middle = scene.smallest_radii_away(place.x);
  if (middle >= kLevels[kContactLevels].blend_to)
    return {level_mix(kContactLevels, middle), {}};
  std::array<Found, kContactLevels + 1> found{};
  std::size_t finest = kContactLevels;
  for (std::size_t k = kContactLevels + 1; k-- > 0;) {
    found[k] = find(k, place);
    found[k].distance = distance(found[k]);
    finest = k;
    if (k == 0 || found[k].distance > kLevels[k - 1].blend_to + kLevels[k].cell)
      break;
  }
  return {finest < kContactLevels ? level_mix(finest, found[finest].distance) : level_mix(kContactLevels, middle),
          found};
}

ReceiverLattice::ReceiverLattice(const LitScene& scene) : state_(std::make_unique<State>(scene)) {}
ReceiverLattice::ReceiverLattice(ReceiverLattice&&) noexcept = default;
ReceiverLattice& ReceiverLattice::operator=(ReceiverLattice&&) noexcept = default;
ReceiverLattice::~ReceiverLattice() = default;

/// The width of the cells follows the smallest object, whose shadow is the sharpest.
void ReceiverLattice::objects_moved() {
  State& s = *state_;
  s.placements.add(++s.placement_version, s.scene.parts);
  ++s.light_version;
  const double smallest = s.scene.parts.smallest_radius();
  if (std::fabs(s.lattices[0].cell_m - kLevels[0].cell * smallest) < 1e-9 * smallest)
    return; // the lattices stand in the room: what they know of the room holds
  for (std::size_t k = 0; k < kLevels.size(); ++k) {
    State::Lattice& lattice = s.lattices[k];
    lattice.cell_m = std::max(std::min(kLevels[k].cell * smallest, kWidestCell_m), kLevels[0].cell * smallest);
    lattice.cells.clear();
    lattice.nodes.clear();
  }
  s.lit.clear();
  s.nodes_made = 0;
}

void ReceiverLattice::sky_changed() {
  ++state_->sky_version;
  ++state_->light_version;
  state_->lit.sky_changed(state_->scene.patches.windows());
}

void ReceiverLattice::light_changed() { ++state_->light_version; }
void ReceiverLattice::mirrored_changed() { ++state_->mirrored_version; }

bool ReceiverLattice::near(const glm::dvec3& x) const {
  return state_->scene.smallest_radii_away(x) < kLevels[kContactLevels].blend_to;
}

double ReceiverLattice::surface_distance(std::uint32_t triangle, const glm::dvec3& x,
                                         const glm::dvec3& direction) const {
  const State& s = *state_;
  const double radius = s.lattices[0].cell_m / kLevels[0].cell;
  return radius * s.distance(s.find(kContactLevels, {triangle, s.scene.facing_of(triangle, direction), x}));
}

double ReceiverLattice::contact_distance() const {
  return kLevels[0].blend_to * state_->lattices[0].cell_m / kLevels[0].cell;
}

IndirectChange ReceiverLattice::at(std::uint32_t triangle, const glm::dvec3& x, const glm::dvec3& direction) const {
  const State& s = *state_;
  const State::Place place{triangle, s.scene.facing_of(triangle, direction), x};
  const State::Mix mix = s.mix_at(place);
  IndirectChange change;
  for (const auto& [k, weight] : {std::pair(mix.level, 1.0f - mix.next), std::pair(mix.level + 1, mix.next)}) {
    if (weight == 0.0f)
      continue;
    const bool known = k <= kContactLevels && mix.found[k].cell;
    const auto part = s.between_nodes(k, known ? mix.found[k] : s.find(k, place), place);
    if (!part)
      return evaluate(triangle, x, direction, kRays);
    change.irradiance += weight * part->irradiance;
    change.before += weight * part->before;
  }
  return change;
}

/// Every direction of the pattern, traced here.
IndirectChange ReceiverLattice::evaluate(std::uint32_t triangle, const glm::dvec3& x, const glm::dvec3& direction,
                                         int count) const {
  const State& s = *state_;
  const glm::dvec3 n = s.scene.normal_of(triangle, direction);
  const glm::dvec3 air = x + kAirGap_m * n;
  const DirectionPattern pattern(count);
  Receiver receiver;
  s.scene.trace(air, n, pattern, receiver);
  const RoomPoint here = s.scene.light.at_surface(triangle, x, direction);
  const Rgb reflected = s.reflected_change(s.changed_surfaces(air, n, pattern), air, n, pattern, here) +
                        LampLight::irradiance(look_at_lamps(s.scene, air, n, pattern));
  const Rgb before = LitScene::before(receiver, here);
  const Rgb gain = s.scene.sent_irradiance(receiver) + s.scene.mirrored_irradiance(receiver);
  const Rgb hidden = s.scene.hidden_irradiance(receiver, here, x, n);
  const Rgb scale = s.scene.gain_scale(gain, before, here, x, n, pattern, receiver);
  return {gain - hidden + (scale - 1.0f) * (gain - (1.0f - receiver.surrounded) * hidden) + reflected, before};
}

ReceiverLattice::Link ReceiverLattice::State::link(std::size_t level, const Found& found, const Place& place) const {
  Link link{found.cell->corner, weights(level, found, place)};
  const float whole = link.weight[0] + link.weight[1] + link.weight[2] + link.weight[3];
  for (float& w : link.weight)
    w = whole < kLeastWeight ? 0.0f : w / whole;
  return link;
}

/// In cells of r/8 or wider where nothing is near: what an object sees is narrower only where it touches the room.
ReceiverLattice::Link ReceiverLattice::State::link(const Place& place, double radii_away) const {
  for (std::size_t level = 0; level < kContactLevels; ++level) {
    // A surface may pass between the corners of any such cell: its distance, 0, is not looked for.
    const Link near = radii_away < 2.0 * kLevels[level].cell ? link(level, find(level, place), place) : Link{};
    if (std::ranges::any_of(near.weight, [](float w) { return w > 0.0f; }))
      return near;
  }
  const std::size_t level = level_mix(kContactLevels, scene.smallest_radii_away(place.x)).level;
  return link(level, find(level, place), place);
}

/// Without the objects, between the corners: E = E_indirect + V_window E_sky. A corner without probes is outside.
bool ReceiverLattice::State::is_even(const ReceiverCell& cell) const {
  float least = std::numeric_limits<float>::infinity(), most = 0.0f;
  for (Node* node : cell.corner) {
    const RoomPoint& light = current_light(*node);
    const float e = is_inside(*node)
                        ? luminance(light.indirect_irradiance + window_visibility(*node) * light.open_sky_irradiance)
                        : 0.0f;
    least = std::min(least, e);
    most = std::max(most, e);
  }
  return least > 0.0f && most <= kMostStep * least;
}

/// In the widest cell whose corners all lie in the same air and are about as bright: beside windows, in reveals, above
/// furniture and along edges it is a narrow one.
ReceiverLattice::Link ReceiverLattice::State::link_in_even_cell(const Place& place) const {
  std::size_t level = level_mix(kContactLevels, scene.smallest_radii_away(place.x)).level;
  for (;; --level) {
    const Found found = find(level, place);
    if (level == kContactLevels || lattices[level].cell_m <= kNarrowestCell_m ||
        (found.cell->open && is_even(*found.cell)))
      return link(level, found, place);
  }
}

ReceiverLattice::Link ReceiverLattice::link(std::uint32_t triangle, const glm::dvec3& x, const glm::dvec3& direction,
                                            double radii_away) const {
  return state_->link({triangle, state_->scene.facing_of(triangle, direction), x}, radii_away);
}

std::size_t ReceiverLattice::node_count() const { return state_->nodes_made; }
std::size_t ReceiverLattice::number_of(const Node& node) { return node.number; }

Rgb ReceiverLattice::whole_change(Node& node, bool sun_too) const { return state_->whole_change(node, sun_too); }

/// E = sum_k w_k E_k, E_k = E_indirect + V_window E_sky of the nodes around, and where an object is near + Delta E -
/// V_blocked E_sky.
RoomIrradiance ReceiverLattice::irradiance_without_sun(std::uint32_t triangle, const glm::dvec3& x,
                                                       const glm::dvec3& direction, bool with_objects) const {
  const State& s = *state_;
  with_objects = with_objects && s.scene.radii_away(x) < kSeenRadii;
  const State::Place place{triangle, s.scene.facing_of(triangle, direction), x};
  const Link around = with_objects && near(x) ? s.link(place, kMirrorRadii) : s.link_in_even_cell(place);
  RoomIrradiance sum;
  float whole = 0.0f;
  for (std::size_t k = 0; k < 4; ++k) {
    if (around.weight[k] == 0.0f)
      continue;
    Node& node = *around.node[k];
    const RoomPoint& light = s.current_light(node);
    if (!State::is_inside(node))
      continue;
    const float visible = s.window_visibility(node);
    const Rgb blocked = with_objects ? s.current_blocked(node) : Rgb(0.0f);
    const Rgb before = light.indirect_irradiance + visible * light.open_sky_irradiance,
              change = with_objects ? s.current(node).irradiance : Rgb(0.0f);
    sum.before += around.weight[k] * before;
    sum.now += around.weight[k] * (before + change - glm::min(blocked, Rgb(visible)) * light.open_sky_irradiance);
    whole += around.weight[k];
  }
  if (whole > 0.0f)
    return {glm::max(sum.now, Rgb(0.0f)) / whole, sum.before / whole};
  const glm::dvec3 n = s.scene.normal_of(triangle, direction);
  const RoomPoint here = s.scene.light.at_surface(triangle, x, direction);
  const Rgb all =
      here.indirect_irradiance + s.scene.windows.visible_fraction(x + kAirGap_m * n, n) * here.open_sky_irradiance;
  return {all, all};
}

} // namespace daylit
