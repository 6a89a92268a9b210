#include "runtime/indirect/indirect_shadow.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>
#include <utility>

#include <glm/geometric.hpp>
#include <tbb/concurrent_unordered_map.h>

#include "runtime/indirect/object_effects.h"
#include "scene/core/parallel.h"

namespace daylit {

namespace {

constexpr int kRays = 48, kFarRays = 24; // per object and receiver
/// How wide cells are and how far they reach, in radii of the objects: at `blend_from` the next level sets in, at
/// `blend_to` it has taken over; the last level has none.
struct Level {
  double cell, blend_from, blend_to;
  int rays;
};
constexpr std::array<Level, 5> kLevels{{{1.0 / 8.0, 1.1, 1.3, kRays},
                                        {1.0 / 4.0, 1.8, 2.2, kRays},
                                        {1.0 / 2.0, 5.0, 6.5, kRays},
                                        {1.0, 10.0, 13.0, kFarRays},
                                        {2.0, 0.0, 0.0, kFarRays}}};
constexpr double kWidestCell_m = 0.5;
constexpr double kLeastFraction = 0.002; // of the cosine-weighted hemisphere
constexpr float kLeastWeight = 0.02f;    // of the corners in view

struct Node {
  Receiver receiver;
  IndirectChange light;
  std::atomic<std::uint64_t> light_version{0}; ///< that `light` belongs to
  std::uint64_t placement_version = 0;         ///< that `receiver` belongs to
  std::mutex renewing;
};

struct Cell {
  bool open = false; ///< its corners lie in the same air
  std::array<Node*, 4> corner{};
};

struct Lattice {
  double cell_m = 0.1;
  const DirectionPattern* pattern = nullptr;
  mutable tbb::concurrent_unordered_map<LatticeKey, std::unique_ptr<Cell>, LatticeHash> cells;
  mutable tbb::concurrent_unordered_map<LatticeKey, std::unique_ptr<Node>, LatticeHash> nodes;
};

} // namespace

struct IndirectShadow::State : LitScene {
  IndirectFeedback indirect_feedback;
  OtherObjects other_objects;
  std::uint64_t sky_version = 0, light_version = 0, placement_version = 1;
  DirectionPattern near_pattern{kRays}, far_pattern{kFarRays};
  std::array<Lattice, kLevels.size()> lattices;

  State(const Room& room, const RayScene& room_rays, std::span<const Aperture> apertures, const RoomLight& room_light)
      : LitScene(room, room_rays, apertures, room_light), indirect_feedback(rays, planes, light, windows),
        other_objects(rays, patches, windows) {
    for (std::size_t k = 0; k < kLevels.size(); ++k)
      lattices[k].pattern = kLevels[k].rays == kRays ? &near_pattern : &far_pattern;
  }

  Node* node(const Lattice& lattice, const LatticeKey& key) const;
  const Cell& cell(const Lattice& lattice, const LatticeKey& key) const;
  const IndirectChange& current(const Lattice& lattice, Node& node, const glm::dvec3& x, std::uint32_t triangle,
                                const glm::dvec3& n) const;
  std::optional<IndirectChange> between_nodes(const Lattice& lattice, std::uint32_t triangle, std::uint32_t facing,
                                              const glm::dvec3& x) const;
};

/// Two threads may make it: one of the two is kept.
Node* IndirectShadow::State::node(const Lattice& lattice, const LatticeKey& key) const {
  auto found = lattice.nodes.find(key);
  if (found == lattice.nodes.end())
    found = lattice.nodes.emplace(key, std::make_unique<Node>()).first;
  return found->second.get();
}

/// Made when first looked up.
const Cell& IndirectShadow::State::cell(const Lattice& lattice, const LatticeKey& key) const {
  const auto found = lattice.cells.find(key);
  if (found != lattice.cells.end())
    return *found->second;
  auto made = std::make_unique<Cell>();
  const RoomFacing& f = planes[key.facing];
  std::array<glm::dvec3, 4> air;
  for (int k = 0; k < 4; ++k) {
    const LatticeKey corner{key.i + (k & 1), key.j + (k >> 1), key.facing};
    air[static_cast<std::size_t>(k)] = f.corner(corner.i, corner.j, lattice.cell_m) + kAirGap_m * f.normal;
    made->corner[static_cast<std::size_t>(k)] = node(lattice, corner);
  }
  made->open = see_each_other(rays, air);
  return *lattice.cells.emplace(key, std::move(made)).first->second;
}

/// Renewed when the light is another; traced anew when an object moved. `n`: the normal at the node.
const IndirectChange& IndirectShadow::State::current(const Lattice& lattice, Node& node, const glm::dvec3& x,
                                                     std::uint32_t triangle, const glm::dvec3& n) const {
  if (node.light_version.load(std::memory_order_acquire) != light_version) {
    const std::lock_guard lock(node.renewing);
    if (node.light_version.load(std::memory_order_relaxed) != light_version) {
      if (std::exchange(node.placement_version, placement_version) != placement_version)
        trace(x + kAirGap_m * n, n, *lattice.pattern, node.receiver);
      node.light = change(node.receiver, triangle, x, -n);
      node.light_version.store(light_version, std::memory_order_release);
    }
  }
  return node.light;
}

/// Bilinear between the corners of the cell; empty where none of them sees x.
std::optional<IndirectChange> IndirectShadow::State::between_nodes(const Lattice& lattice, std::uint32_t triangle,
                                                                   std::uint32_t facing, const glm::dvec3& x) const {
  const RoomFacing& f = planes[facing];
  const LatticeSquare square = f.square(x, lattice.cell_m);
  const Cell& around = cell(lattice, {square.i, square.j, facing});
  IndirectChange sum;
  float whole = 0.0f;
  for (int k = 0; k < 4; ++k) {
    const glm::dvec3 corner = f.corner(square.i + (k & 1), square.j + (k >> 1), lattice.cell_m);
    // A cell that furniture cuts, or that leaves the room: corners in view stand for the others.
    if (!around.open && !windows.visible(x + kAirGap_m * f.normal, corner + kAirGap_m * f.normal))
      continue;
    const IndirectChange& c = current(lattice, *around.corner[static_cast<std::size_t>(k)], corner, triangle, f.normal);
    sum.irradiance += square.weight[k] * c.irradiance;
    sum.before += square.weight[k] * c.before;
    whole += square.weight[k];
  }
  if (whole < kLeastWeight)
    return std::nullopt;
  return IndirectChange{sum.irradiance / whole, sum.before / whole};
}

IndirectShadow::IndirectShadow(const Room& room, const RayScene& room_rays, std::span<const Aperture> apertures,
                               const RoomLight& room_light)
    : state_(std::make_unique<State>(room, room_rays, apertures, room_light)) {}
IndirectShadow::IndirectShadow(IndirectShadow&&) noexcept = default;
IndirectShadow& IndirectShadow::operator=(IndirectShadow&&) noexcept = default;
IndirectShadow::~IndirectShadow() = default;

/// The width of the cells follows the smallest object, whose shadow is the sharpest.
void IndirectShadow::set_objects(std::vector<PlacedPart> parts) {
  State& s = *state_;
  s.parts = PlacedParts(std::move(parts));
  s.indirect_feedback.set_objects(s.parts);
  s.other_objects.set_objects(s.parts);
  ++s.placement_version;
  ++s.light_version;
  double smallest = s.parts.size() == 0 ? 1.0 : std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < s.parts.size(); ++k)
    smallest = std::min(smallest, std::max(s.parts.sphere(k).radius, 1e-3));
  if (std::fabs(s.lattices[0].cell_m - kLevels[0].cell * smallest) < 1e-9 * smallest)
    return; // the lattices stand in the room: what they know of the room holds
  for (std::size_t k = 0; k < kLevels.size(); ++k) {
    Lattice& lattice = s.lattices[k];
    lattice.cell_m = std::max(std::min(kLevels[k].cell * smallest, kWidestCell_m), kLevels[0].cell * smallest);
    lattice.cells.clear();
    lattice.nodes.clear();
  }
}

void IndirectShadow::set_sky(std::span<const SkyMap> pyramid, const std::optional<DetectedSun>& sun,
                             std::uint64_t sky_version) {
  State& s = *state_;
  if (std::exchange(s.sky_version, sky_version) != sky_version || sky_version == 0) {
    s.windows.set_sun(sun); // also one that does not reach the objects: they may stand before a patch of it
    s.patches.set_frame(pyramid, s.windows.apertures());
  }
  s.indirect_feedback.set_frame();
}

Sh9Rgb IndirectShadow::feedback(std::size_t part, const glm::dvec3& x) const {
  return state_->indirect_feedback.change(part, x);
}

/// L_out = radiance + rho / pi E_sun V, on both sides.
void IndirectShadow::set_light(std::vector<TwoSided> radiance, const ObjectSurface& surface) {
  State& s = *state_;
  s.radiance = std::move(radiance);
  if (s.windows.has_sun())
    parallel_for(tbb::blocked_range<std::size_t>(0, s.radiance.size(), 64), [&](const auto& range) {
      for (std::size_t i = range.begin(); i != range.end(); ++i) {
        const glm::dvec3 n(surface.normals[i]);
        s.radiance[i].front += s.reflected_sun(surface.positions[i], n, surface.reflectance[i]);
        s.radiance[i].back += s.reflected_sun(surface.positions[i], -n, surface.reflectance[i]);
      }
    });
  ++s.light_version;
}

bool IndirectShadow::objects_see_each_other() const { return state_->other_objects.any(); }
void IndirectShadow::exchange() { state_->other_objects.set_light(state_->radiance); }
Sh9Rgb IndirectShadow::exchanged(std::size_t part, const glm::dvec3& x) const {
  return state_->other_objects.change(part, x);
}

/// r^2 / d^2, the form factor of a sphere that faces x (Howell B-4), above kLeastFraction for some object.
bool IndirectShadow::affects(const glm::dvec3& x) const {
  const PlacedParts& parts = state_->parts;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const glm::dvec3 d = parts.sphere(k).centre - x;
    if (parts.sphere(k).radius * parts.sphere(k).radius > kLeastFraction * glm::dot(d, d))
      return true;
  }
  return false;
}

bool IndirectShadow::near(const glm::dvec3& x) const { return state_->radii_away(x) < kLevels[0].blend_to; }

/// Between two levels the change is blended with 3 t^2 - 2 t^3, t = (d - from) / (to - from): no step where cells grow.
IndirectChange IndirectShadow::at(std::uint32_t triangle, const glm::dvec3& x, const glm::dvec3& direction) const {
  const State& s = *state_;
  const std::uint32_t facing = s.facing_of(triangle, direction);
  const double away = s.radii_away(x);
  std::size_t level = 0;
  while (level + 1 < kLevels.size() && away >= kLevels[level].blend_to)
    ++level;
  const Level& l = kLevels[level];
  const double t =
      level + 1 < kLevels.size() ? std::max(0.0, (away - l.blend_from) / (l.blend_to - l.blend_from)) : 0.0;
  const auto next = static_cast<float>(t * t * (3.0 - 2.0 * t));
  IndirectChange change;
  for (const auto& [k, weight] : {std::pair(level, 1.0f - next), std::pair(level + 1, next)}) {
    if (weight == 0.0f)
      continue;
    const auto part = s.between_nodes(s.lattices[k], triangle, facing, x);
    if (!part)
      return evaluate(triangle, x, direction, kRays);
    change.irradiance += weight * part->irradiance;
    change.before += weight * part->before;
  }
  return change;
}

/// Every direction of the pattern, traced here.
IndirectChange IndirectShadow::evaluate(std::uint32_t triangle, const glm::dvec3& x, const glm::dvec3& direction,
                                        int count) const {
  const State& s = *state_;
  const glm::dvec3 n = s.normal_of(triangle, direction);
  Receiver receiver;
  s.trace(x + kAirGap_m * n, n, count == kRays ? s.near_pattern : DirectionPattern(count), receiver);
  return s.change(receiver, triangle, x, direction);
}

Rgb IndirectShadow::sun_irradiance(std::uint32_t triangle, const glm::dvec3& x, const glm::dvec3& direction) const {
  const glm::dvec3 n = state_->normal_of(triangle, direction);
  return state_->windows.sun(x + kAirGap_m * n, n);
}

std::uint32_t IndirectShadow::facing_of(std::uint32_t triangle, const glm::dvec3& direction) const {
  return state_->facing_of(triangle, direction);
}

} // namespace daylit
