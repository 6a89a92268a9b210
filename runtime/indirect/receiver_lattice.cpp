#include "runtime/indirect/receiver_lattice.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <utility>

#include <glm/geometric.hpp>
#include <tbb/concurrent_unordered_map.h>

#include "runtime/base/once.h"
#include "runtime/indirect/receiver_levels.h"
#include "runtime/indirect/receiver_node.h"

namespace daylit {

namespace {

constexpr float kLeastWeight = 0.02f; // of the corners in view
constexpr int kLampRays = 64;         // to what lamps light

struct Cell {
  bool open = false; ///< its corners lie in the same air
  std::array<ReceiverLattice::Node*, 4> corner{};
};

} // namespace

struct ReceiverLattice::State {
  struct Lattice {
    double cell_m = 0.1;
    std::vector<DirectionPattern> patterns; ///< by phase
    mutable tbb::concurrent_unordered_map<LatticeKey, std::unique_ptr<Cell>, LatticeHash> cells;
    mutable tbb::concurrent_unordered_map<LatticeKey, std::unique_ptr<Node>, LatticeHash> nodes;
  };
  const LitScene& scene;
  std::uint64_t light_version = 0, sky_version = 1, placement_version = 1, mirrored_version = 1;
  std::array<Lattice, kLevels.size()> lattices;
  mutable std::atomic<std::size_t> nodes_made{0};
  mutable LitPoints lit; ///< of the nodes
  DirectionPattern lamp_pattern{kLampRays};

  explicit State(const LitScene& s) : scene(s), lit(s.light) {
    for (std::size_t k = 0; k < kLevels.size(); ++k)
      for (int phase = 0; phase < DirectionPattern::kPhases; ++phase)
        lattices[k].patterns.emplace_back(kLevels[k].rays, phase);
  }
  Node* node(std::size_t level, const LatticeKey& key, std::uint32_t triangle) const;
  const Cell& cell(std::size_t level, const LatticeKey& key, std::uint32_t triangle) const;
  void renew(Node& node) const;
  const IndirectChange& current(Node& node) const;
  Rgb whole_change(Node& node, bool sun_too = true) const;
  Rgb reflected_change(std::span<const ChangedSurface> surfaces) const;
  const Rgb& reflected(Node& node) const;
  float current_distance(Node& node) const;
  const RoomPoint& current_light(Node& node) const;
  float current_blocked(Node& node) const;
  float window_visibility(Node& node) const;

  /// A point of a plane.
  struct Place {
    std::uint32_t triangle = 0, facing = 0;
    glm::dvec3 x{0.0};
  };
  /// The cell that it lies in.
  struct Found {
    const Cell* cell = nullptr;
    LatticeSquare square;
    double distance = 0.0; ///< to the nearest surface of an object, radii, where it was looked for
  };
  Found find(std::size_t level, const Place& place) const;
  double distance(const Found& found) const;
  std::array<float, 4> weights(std::size_t level, const Found& found, const Place& place) const;
  Link link(std::size_t level, const Found& found, const Place& place) const;
  Link link(std::uint32_t triangle, const glm::dvec3& x, const glm::dvec3& direction, double radii_away) const;
  std::vector<ChangedSurface> changed_surfaces(const glm::dvec3& air, const glm::dvec3& n,
                                               const DirectionPattern& pattern) const;
  std::optional<IndirectChange> between_nodes(std::size_t level, const Found& found, const Place& place) const;
  /// Which level holds at a place, and how much of the next one is mixed in.
  struct Mix : LevelMix {
    std::array<Found, kContactLevels + 1> found{}; ///< of the levels looked at on the way; others have no cell
  };
  Mix mix_at(const Place& place) const;
};

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
const Cell& ReceiverLattice::State::cell(std::size_t level, const LatticeKey& key, std::uint32_t triangle) const {
  const Lattice& lattice = lattices[level];
  if (const auto found = lattice.cells.find(key); found != lattice.cells.end())
    return *found->second;
  auto made = std::make_unique<Cell>();
  std::array<glm::dvec3, 4> air;
  for (int k = 0; k < 4; ++k) {
    Node* corner = node(level, {key.i + (k & 1), key.j + (k >> 1), key.facing}, triangle);
    air[static_cast<std::size_t>(k)] = corner->x + kAirGap_m * corner->n;
    made->corner[static_cast<std::size_t>(k)] = corner;
  }
  made->open = see_each_other(scene.rays, air);
  return *lattice.cells.emplace(key, std::move(made)).first->second;
}

/// Traced anew when an object moved; what is behind the objects anew under another sky.
void ReceiverLattice::State::renew(Node& node) const {
  if (std::exchange(node.placement_version, placement_version) != placement_version) {
    scene.trace(node.x + kAirGap_m * node.n, node.n, *node.pattern, node.receiver);
    node.sky_version = node.mirrored_version = 0;
  }
  if (std::exchange(node.sky_version, sky_version) != sky_version) {
    node.here = scene.light.at_surface(node.triangle, node.x, -node.n);
    node.hidden = scene.hidden_irradiance(node.receiver, node.here, node.x, node.n);
    node.before = LitScene::before(node.receiver, node.here);
  }
  if (std::exchange(node.mirrored_version, mirrored_version) != mirrored_version)
    node.mirrored = scene.mirrored_irradiance(node.receiver);
  node.change = {scene.sent_irradiance(node.receiver) + node.mirrored - node.hidden, node.before};
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

std::vector<ChangedSurface> ReceiverLattice::State::changed_surfaces(const glm::dvec3& air, const glm::dvec3& n,
                                                                     const DirectionPattern& pattern) const {
  return find_changed_surfaces(scene, air, n, pattern,
                               [this](auto triangle, const auto& x, const auto& direction, double radii_away) {
                                 return link(triangle, x, direction, radii_away);
                               });
}

/// sum over the surfaces of rho / pi cos dw of Delta E there.
Rgb ReceiverLattice::State::reflected_change(std::span<const ChangedSurface> surfaces) const {
  Rgb sum(0.0f);
  for (const ChangedSurface& s : surfaces)
    for (std::size_t k = 0; k < 4; ++k)
      if (s.link.weight[k] > 0.0f)
        sum += s.weight * s.link.weight[k] * whole_change(*s.link.node[k]);
  return sum;
}

const Rgb& ReceiverLattice::State::reflected(Node& node) const {
  once(node.reflected_version, light_version, node.reflecting, [&] {
    if (std::exchange(node.around_version, placement_version) != placement_version) {
      node.around = changed_surfaces(node.x + kAirGap_m * node.n, node.n, *node.pattern);
      node.lamps = look_at_lamps(scene, node.x + kAirGap_m * node.n, node.n, lamp_pattern);
    }
    node.reflected = reflected_change(node.around) + LampLight::irradiance(node.lamps);
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

float ReceiverLattice::State::current_blocked(Node& node) const {
  once(node.blocked_version, placement_version, node.renewing,
       [&] { node.blocked = scene.windows.blocked_fraction(node.x + kAirGap_m * node.n, node.n, scene.parts); });
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

/// Empty where none of the corners sees x.
std::optional<IndirectChange> ReceiverLattice::State::between_nodes(std::size_t level, const Found& found,
                                                                    const Place& place) const {
  const std::array<float, 4> weight = weights(level, found, place);
  IndirectChange sum;
  float whole = 0.0f;
  for (std::size_t k = 0; k < 4; ++k) {
    if (weight[k] == 0.0f)
      continue;
    const IndirectChange& c = current(*found.cell->corner[k]);
    sum.irradiance += weight[k] * (c.irradiance + reflected(*found.cell->corner[k]));
    sum.before += weight[k] * c.before;
    whole += weight[k];
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
  ++s.placement_version;
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
  state_->lit.sky_changed();
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
  Receiver receiver;
  s.scene.trace(x + kAirGap_m * n, n, DirectionPattern(count), receiver);
  const RoomPoint here = s.scene.light.at_surface(triangle, x, direction);
  const Rgb reflected = s.reflected_change(s.changed_surfaces(x + kAirGap_m * n, n, DirectionPattern(count))) +
                        LampLight::irradiance(look_at_lamps(s.scene, x + kAirGap_m * n, n, DirectionPattern(count)));
  return {s.scene.sent_irradiance(receiver) + s.scene.mirrored_irradiance(receiver) -
              s.scene.hidden_irradiance(receiver, here, x, n) + reflected,
          LitScene::before(receiver, here)};
}

ReceiverLattice::Link ReceiverLattice::State::link(std::size_t level, const Found& found, const Place& place) const {
  Link link{found.cell->corner, weights(level, found, place)};
  const float whole = link.weight[0] + link.weight[1] + link.weight[2] + link.weight[3];
  for (float& w : link.weight)
    w = whole < kLeastWeight ? 0.0f : w / whole;
  return link;
}

/// In cells of r/8 or wider where nothing is near: what an object sees is narrower only where it touches the room.
ReceiverLattice::Link ReceiverLattice::State::link(std::uint32_t triangle, const glm::dvec3& x,
                                                   const glm::dvec3& direction, double radii_away) const {
  const Place place{triangle, scene.facing_of(triangle, direction), x};
  for (std::size_t level = 0; level < kContactLevels; ++level) {
    // A surface may pass between the corners of any such cell: its distance, 0, is not looked for.
    const Link near = radii_away < 2.0 * kLevels[level].cell ? link(level, find(level, place), place) : Link{};
    if (std::ranges::any_of(near.weight, [](float w) { return w > 0.0f; }))
      return near;
  }
  const std::size_t level = level_mix(kContactLevels, scene.smallest_radii_away(x)).level;
  return link(level, find(level, place), place);
}

ReceiverLattice::Link ReceiverLattice::link(std::uint32_t triangle, const glm::dvec3& x, const glm::dvec3& direction,
                                            double radii_away) const {
  return state_->link(triangle, x, direction, radii_away);
}

std::size_t ReceiverLattice::node_count() const { return state_->nodes_made; }
std::size_t ReceiverLattice::number_of(const Node& node) { return node.number; }

Rgb ReceiverLattice::whole_change(Node& node, bool sun_too) const { return state_->whole_change(node, sun_too); }

/// E = sum_k w_k E_k, E_k = E_indirect + V_window E_sky of the nodes around, and where an object is near + Delta E -
/// V_blocked E_sky.
Rgb ReceiverLattice::irradiance_without_sun(std::uint32_t triangle, const glm::dvec3& x,
                                            const glm::dvec3& direction) const {
  const State& s = *state_;
  const bool with_objects = s.scene.radii_away(x) < kSeenRadii;
  const Link around = link(triangle, x, direction, with_objects && near(x) ? kMirrorRadii : kSeenRadii);
  Rgb sum(0.0f);
  float whole = 0.0f;
  for (std::size_t k = 0; k < 4; ++k) {
    if (around.weight[k] == 0.0f)
      continue;
    Node& node = *around.node[k];
    const RoomPoint& light = s.current_light(node);
    const float seen = s.window_visibility(node) - (with_objects ? s.current_blocked(node) : 0.0f);
    const Rgb change = with_objects ? s.current(node).irradiance : Rgb(0.0f);
    sum += around.weight[k] * (light.indirect_irradiance + std::max(seen, 0.0f) * light.open_sky_irradiance + change);
    whole += around.weight[k];
  }
  if (whole > 0.0f)
    return glm::max(sum, Rgb(0.0f));
  const glm::dvec3 n = s.scene.normal_of(triangle, direction);
  const RoomPoint here = s.scene.light.at_surface(triangle, x, direction);
  return here.indirect_irradiance + s.scene.windows.visible_fraction(x + kAirGap_m * n, n) * here.open_sky_irradiance;
}

} // namespace daylit
