#include "runtime/light/room_change.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>
#include <numbers>
#include <utility>

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <tbb/blocked_range.h>
#include <tbb/concurrent_unordered_map.h>
#include <tbb/parallel_for.h>

#include "runtime/light/orthonormal.h"
#include "runtime/light/own_shadow.h"
#include "runtime/light/room_patches.h"
#include "runtime/light/room_planes.h"
#include "runtime/light/window_sampler.h"
#include "runtime/light/window_sight.h"

namespace daylit {

namespace {

constexpr int kRays = 48;                // per object and receiver
constexpr double kFineShare = 1.0 / 8.0; // of an object's radius: cells near it
constexpr double kNear = 1.6;            // radii: within are fine cells, beyond four times as wide
constexpr double kLeastShare = 0.002;    // of the cosine-weighted hemisphere
constexpr double kSkin = 0.01;           // of an object's radius: its own facets cast no shadow closer than this
constexpr float kLeastWeight = 0.02f;    // of the corners in sight

/// One direction that an object covers.
struct Covered {
  PartHit object;
  float weight = 0.0f;         ///< cos dw, sr
  RoomPatch* behind = nullptr; ///< null: the sky
  glm::dvec3 position{0.0};    ///< behind it
};

/// What does not depend on the light.
struct Receiver {
  std::vector<Covered> covered; ///< until an object moves
  float sky_share = -1.0f;      ///< of the windows' light that reaches it past the room; negative: not yet known
};

struct Node {
  Receiver receiver;
  RoomChange light;
  std::atomic<std::uint64_t> light_number{0}; ///< that `light` belongs to
  std::uint64_t placing_number = 0;           ///< that `receiver` belongs to
  std::mutex renewing;
};

struct Cell {
  bool open = false; ///< its corners lie in the same air
  std::array<Node*, 4> corner{};
};

struct Lattice {
  double cell_m = 0.1;
  mutable tbb::concurrent_unordered_map<LatticeKey, std::unique_ptr<Cell>, LatticeHash> cells;
  mutable tbb::concurrent_unordered_map<LatticeKey, std::unique_ptr<Node>, LatticeHash> nodes;
};

} // namespace

struct RoomChangeField::State {
  const RayScene& rays;
  const RoomLight& room_light;
  RoomPlanes planes;
  WindowSight sight;
  RoomPatches patches;
  OwnShadow own_shadow;
  PlacedParts parts;
  std::vector<TwoSided> radiance;
  std::uint64_t light_number = 0, placing_number = 1;
  Lattice fine, coarse;

  State(const Room& room, const RayScene& room_rays, std::span<const Aperture> apertures, const RoomLight& light)
      : rays(room_rays), room_light(light), planes(room), sight(room_rays, apertures),
        patches(room, room_rays, planes, light), own_shadow(room_rays, planes, light, sight) {}

  void trace_part(std::size_t which, const glm::dvec3& x, const glm::dvec3& n, int count, Receiver& receiver) const;
  void trace(const glm::dvec3& x, const glm::dvec3& n, int count, Receiver& receiver) const;
  Rgb reflected_sun(const glm::dvec3& x, const glm::dvec3& n, const Rgb& reflectance) const;
  Rgb radiance_behind(const Covered& c, std::size_t number) const;
  RoomChange lit(const Receiver& receiver, std::uint32_t triangle, const glm::dvec3& x,
                 const glm::dvec3& direction) const;
  Node* node(const Lattice& lattice, const LatticeKey& key) const;
  const Cell& cell(const Lattice& lattice, const LatticeKey& key) const;
  const RoomChange& current(Node& node, const glm::dvec3& x, std::uint32_t triangle, const glm::dvec3& n) const;
  bool near(const glm::dvec3& x) const;
};

void RoomChangeField::State::trace_part(std::size_t which, const glm::dvec3& x, const glm::dvec3& n, int count,
                                        Receiver& receiver) const {
  const BoundingSphere& sphere = parts.sphere(which);
  const glm::dvec3 to = sphere.centre - x;
  const double distance = glm::length(to), s = sphere.radius / std::max(distance, 1e-9);
  if (sphere.radius <= 0.0 || glm::dot(n, to) < -sphere.radius)
    return;
  // Close by, the sphere covers most of what x sees: then the whole hemisphere, by its cosine.
  const bool whole = s > 0.98;
  const double cos_max = whole ? 0.0 : std::sqrt(1.0 - s * s), all = 2.0 * std::numbers::pi * (1.0 - cos_max);
  const glm::dvec3 axis = whole ? n : to / distance;
  const OrthonormalBasis basis(axis);
  for (int k = 0; k < count; ++k) {
    const glm::dvec2 u = lattice_point(k, count);
    const double up = whole ? std::sqrt(1.0 - u.x) : 1.0 - u.x * (1.0 - cos_max);
    const double side = std::sqrt(std::max(0.0, 1.0 - up * up)), turn = 2.0 * std::numbers::pi * u.y;
    const glm::dvec3 w = glm::normalize(side * std::cos(turn) * basis.u + side * std::sin(turn) * basis.v + up * axis);
    const double cosine = glm::dot(n, w);
    Covered c;
    if (cosine <= 0.0 || !parts.cast_first(which, x, w, c.object))
      continue;
    RayHit room_hit;
    const bool ends =
        rays.closest(rays.to_local(x), glm::vec3(w), 0.0f, std::numeric_limits<float>::infinity(), room_hit);
    if (ends && static_cast<double>(room_hit.distance) < c.object.distance)
      continue;
    c.weight = static_cast<float>((whole ? std::numbers::pi : all * cosine) / count);
    if (ends) {
      c.position = x + static_cast<double>(room_hit.distance) * w;
      c.behind = patches.at(room_hit.triangle, c.position, w);
    }
    receiver.covered.push_back(c);
  }
}

/// What of the receiver still holds is kept.
void RoomChangeField::State::trace(const glm::dvec3& x, const glm::dvec3& n, int count, Receiver& receiver) const {
  receiver.covered.clear();
  for (std::size_t k = 0; k < parts.size(); ++k)
    trace_part(k, x, n, count, receiver);
  if (receiver.sky_share < 0.0f)
    receiver.sky_share = sight.window_share(x, n);
}

/// The room's radiance that the object hides; one of the sun's samples stands for all.
Rgb RoomChangeField::State::radiance_behind(const Covered& c, std::size_t number) const {
  if (!c.behind)
    return Rgb(0.0f);
  const glm::dvec3& n = c.behind->normal;
  const Rgb irradiance = patches.irradiance(*c.behind) + sight.sun_sample(number, c.position + kAirGap_m * n, n);
  return c.behind->reflectance * irradiance * std::numbers::inv_pi_v<float>;
}

RoomChange RoomChangeField::State::lit(const Receiver& receiver, std::uint32_t triangle, const glm::dvec3& x,
                                       const glm::dvec3& direction) const {
  RoomChange change;
  for (std::size_t k = 0; k < receiver.covered.size(); ++k) {
    const Covered& c = receiver.covered[k];
    const float b[3] = {1.0f - c.object.u - c.object.v, c.object.u, c.object.v};
    Rgb object(0.0f);
    for (int i = 0; i < 3; ++i) {
      const TwoSided& vertex = radiance[c.object.vertex[i]];
      object += b[i] * (c.object.back ? vertex.back : vertex.front);
    }
    change.irradiance += c.weight * (object - radiance_behind(c, k));
  }
  const RoomPoint point = room_light.at_surface(triangle, x, direction);
  change.before = point.indirect_irradiance + receiver.sky_share * point.open_sky_irradiance;
  return change;
}

Node* RoomChangeField::State::node(const Lattice& lattice, const LatticeKey& key) const {
  auto found = lattice.nodes.find(key);
  if (found == lattice.nodes.end())
    found = lattice.nodes.emplace(key, std::make_unique<Node>()).first;
  return found->second.get();
}

const Cell& RoomChangeField::State::cell(const Lattice& lattice, const LatticeKey& key) const {
  auto found = lattice.cells.find(key);
  if (found != lattice.cells.end())
    return *found->second;
  auto made = std::make_unique<Cell>();
  const RoomFacing& f = planes[key.facing];
  glm::dvec3 air[4];
  for (int k = 0; k < 4; ++k) {
    air[k] = f.corner(key.i + (k & 1), key.j + (k >> 1), lattice.cell_m) + kAirGap_m * f.normal;
    made->corner[k] = node(lattice, {key.i + (k & 1), key.j + (k >> 1), key.facing});
  }
  made->open = true;
  constexpr int kWays[6][2] = {{0, 3}, {1, 2}, {0, 1}, {2, 3}, {0, 2}, {1, 3}};
  for (const auto& way : kWays)
    made->open = made->open && sight.sees(air[way[0]], air[way[1]]);
  return *lattice.cells.emplace(key, std::move(made)).first->second;
}

const RoomChange& RoomChangeField::State::current(Node& node, const glm::dvec3& x, std::uint32_t triangle,
                                                  const glm::dvec3& n) const {
  if (node.light_number.load(std::memory_order_acquire) != light_number) {
    const std::lock_guard lock(node.renewing);
    if (node.light_number.load(std::memory_order_relaxed) != light_number) {
      if (std::exchange(node.placing_number, placing_number) != placing_number)
        trace(x + kAirGap_m * n, n, kRays, node.receiver);
      node.light = lit(node.receiver, triangle, x, -n);
      node.light_number.store(light_number, std::memory_order_release);
    }
  }
  return node.light;
}

bool RoomChangeField::State::near(const glm::dvec3& x) const {
  for (std::size_t k = 0; k < parts.size(); ++k)
    if (glm::length(x - parts.sphere(k).centre) < kNear * parts.sphere(k).radius)
      return true;
  return false;
}

/// The sun's light on one side of an object's surface, reflected.
Rgb RoomChangeField::State::reflected_sun(const glm::dvec3& x, const glm::dvec3& n, const Rgb& reflectance) const {
  const Rgb irradiance = sight.sun_sample(0, x + kAirGap_m * n, n);
  if (irradiance == Rgb(0.0f))
    return irradiance;
  double skin = kAirGap_m;
  for (std::size_t k = 0; k < parts.size(); ++k)
    skin = std::max(skin, kSkin * parts.sphere(k).radius);
  if (parts.covered(x + skin * n, sight.sun_direction()))
    return Rgb(0.0f);
  return reflectance * irradiance * std::numbers::inv_pi_v<float>;
}

RoomChangeField::RoomChangeField(const Room& room, const RayScene& room_rays, std::span<const Aperture> apertures,
                                 const RoomLight& room_light)
    : state_(std::make_unique<State>(room, room_rays, apertures, room_light)) {}
RoomChangeField::RoomChangeField(RoomChangeField&&) noexcept = default;
RoomChangeField& RoomChangeField::operator=(RoomChangeField&&) noexcept = default;
RoomChangeField::~RoomChangeField() = default;

void RoomChangeField::set_objects(std::vector<PlacedPart> parts) {
  State& s = *state_;
  s.parts = PlacedParts(std::move(parts));
  s.own_shadow.set_objects(s.parts);
  ++s.placing_number;
  ++s.light_number;
  double smallest = s.parts.size() == 0 ? 1.0 : std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < s.parts.size(); ++k)
    smallest = std::min(smallest, std::max(s.parts.sphere(k).radius, 1e-3));
  if (s.coarse.cell_m == 4.0 * s.fine.cell_m && std::fabs(s.fine.cell_m - kFineShare * smallest) < 1e-9 * smallest)
    return; // the lattice stands in the room: what it knows of the room holds
  s.fine.cell_m = kFineShare * smallest;
  s.coarse.cell_m = 4.0 * s.fine.cell_m;
  for (Lattice* lattice : {&s.fine, &s.coarse}) {
    lattice->cells.clear();
    lattice->nodes.clear();
  }
}

void RoomChangeField::set_sky(std::span<const SkyMap> pyramid, const std::optional<DetectedSun>& sun) {
  State& s = *state_;
  s.sight.set_sun(sun); // also one that does not reach the objects: they may stand before a patch of it
  s.patches.set_frame(pyramid, s.sight.apertures());
  s.own_shadow.set_frame();
}

Sh9Rgb RoomChangeField::arriving_change(std::size_t part, const glm::dvec3& x) const {
  return state_->own_shadow.change(part, x);
}

void RoomChangeField::set_light(std::vector<TwoSided> radiance, std::span<const glm::dvec3> positions,
                                std::span<const glm::vec3> normals, std::span<const Rgb> reflectance) {
  State& s = *state_;
  s.radiance = std::move(radiance);
  if (s.sight.has_sun())
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, positions.size(), 64), [&](const auto& range) {
      for (std::size_t i = range.begin(); i != range.end(); ++i) {
        const glm::dvec3 n(normals[i]);
        s.radiance[i].front += s.reflected_sun(positions[i], n, reflectance[i]);
        s.radiance[i].back += s.reflected_sun(positions[i], -n, reflectance[i]);
      }
    });
  ++s.light_number;
}

bool RoomChangeField::reaches(const glm::dvec3& x) const {
  const PlacedParts& parts = state_->parts;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const glm::dvec3 d = parts.sphere(k).centre - x;
    if (parts.sphere(k).radius * parts.sphere(k).radius > kLeastShare * glm::dot(d, d))
      return true;
  }
  return false;
}

bool RoomChangeField::near(const glm::dvec3& x) const { return state_->near(x); }

RoomChange RoomChangeField::at(std::uint32_t triangle, const glm::dvec3& x, const glm::dvec3& direction) const {
  const State& s = *state_;
  const std::uint32_t facing = s.planes.facing_of(triangle, direction);
  const RoomFacing& f = s.planes[facing];
  const Lattice& lattice = s.near(x) ? s.fine : s.coarse;
  const glm::dvec2 p(glm::dot(f.u, x) / lattice.cell_m, glm::dot(f.v, x) / lattice.cell_m);
  const glm::dvec2 lower = glm::floor(p);
  const LatticeKey key{static_cast<std::int64_t>(lower.x), static_cast<std::int64_t>(lower.y), facing};
  const Cell& cell = s.cell(lattice, key);
  const glm::vec2 t(p - lower);
  const float weight[4] = {(1 - t.x) * (1 - t.y), t.x * (1 - t.y), (1 - t.x) * t.y, t.x * t.y};
  RoomChange sum;
  float whole = 0.0f;
  for (int k = 0; k < 4; ++k) {
    const glm::dvec3 corner = f.corner(key.i + (k & 1), key.j + (k >> 1), lattice.cell_m);
    // A cell that furniture cuts, or that reaches out of the room: corners in sight stand for the others.
    if (!cell.open && !s.sight.sees(x + kAirGap_m * f.normal, corner + kAirGap_m * f.normal))
      continue;
    const RoomChange& c = s.current(*cell.corner[k], corner, triangle, f.normal);
    sum.irradiance += weight[k] * c.irradiance;
    sum.before += weight[k] * c.before;
    whole += weight[k];
  }
  if (whole < kLeastWeight)
    return evaluate(triangle, x, direction, kRays);
  return {sum.irradiance / whole, sum.before / whole};
}

RoomChange RoomChangeField::evaluate(std::uint32_t triangle, const glm::dvec3& x, const glm::dvec3& direction,
                                     int count) const {
  const State& s = *state_;
  const glm::dvec3 n = s.planes[s.planes.facing_of(triangle, direction)].normal;
  Receiver receiver;
  s.trace(x + kAirGap_m * n, n, count, receiver);
  return s.lit(receiver, triangle, x, direction);
}

Rgb RoomChangeField::sun_irradiance(std::uint32_t triangle, const glm::dvec3& x, const glm::dvec3& direction) const {
  const glm::dvec3 n = state_->planes[state_->planes.facing_of(triangle, direction)].normal;
  return state_->sight.sun(x + kAirGap_m * n, n);
}

std::uint32_t RoomChangeField::facing_of(std::uint32_t triangle, const glm::dvec3& direction) const {
  return state_->planes.facing_of(triangle, direction);
}

} // namespace daylit
