#include "runtime/light/room_change.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>
#include <numbers>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec2.hpp>
#include <tbb/blocked_range.h>
#include <tbb/concurrent_unordered_map.h>
#include <tbb/parallel_for.h>

#include "runtime/light/orthonormal.h"
#include "runtime/light/room_planes.h"
#include "runtime/light/window_sampler.h"
#include "scene/aperture.h"
#include "sh/sh9.h"

namespace daylit {

namespace {

constexpr double kAir = 1e-3;             // receivers lie this far before their surface, metres
constexpr int kRays = 48;                 // per object and receiver
constexpr double kFineShare = 1.0 / 8.0; // of an object's radius: cells near it
constexpr double kNear = 1.6;             // radii: within are fine cells, beyond four times as wide
constexpr double kLeastShare = 0.002;     // of the cosine-weighted hemisphere
constexpr double kSkin = 0.01;            // of an object's radius: its own facets cast no shadow closer than this
constexpr float kLeastWeight = 0.02f;     // of the corners in sight
constexpr int kSunSamples = 8;
constexpr int kAround = 128;           // directions in which an object looks around
constexpr double kInset = 0.1;         // of the box: its eight points lie inside
constexpr double kSurroundRadii = 4.0; // shadows further away are not looked for
constexpr int kWindowPoints = 4;       // per side: visibility of a window from a receiver
constexpr int kPatchPoints = 5;
constexpr double kPatch_m = 0.35; // of the room behind objects: its light without the sun is kept per patch
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// Part of a plane of the room, seen from one side, of one material.
struct Patch {
  bool lit = false; ///< some point of it lies in the air of the room
  glm::dvec3 point{0.0}, normal{0.0};
  VertexProbes probes;
  Rgb reflectance{0.5f}, irradiance{0.0f}; ///< without the sun's
  std::atomic<std::uint64_t> light_number{0};
  std::mutex renewing;
};

/// One direction that an object covers.
struct Covered {
  std::array<std::uint32_t, 3> vertex{};
  float u = 0.0f, v = 0.0f, weight = 0.0f; ///< cos dw, sr
  bool back = false;
  Patch* behind = nullptr;  ///< null: the sky
  glm::dvec3 position{0.0}; ///< behind it
};

/// What does not depend on the light.
struct Receiver {
  std::vector<Covered> covered;
  float sky_share = 1.0f; ///< of the windows' light that reaches it past the room
};

struct Node {
  Receiver receiver;
  RoomChange light;
  std::atomic<std::uint64_t> light_number{0}; ///< that `light` belongs to
  std::once_flag traced;
  std::mutex renewing;
};

struct Cell {
  bool open = false; ///< its corners lie in the same air
  std::array<Node*, 4> corner{};
};

using PatchMap = tbb::concurrent_unordered_map<LatticeKey, std::unique_ptr<Patch>, LatticeHash>;
using CellMap = tbb::concurrent_unordered_map<LatticeKey, std::unique_ptr<Cell>, LatticeHash>;
using NodeMap = tbb::concurrent_unordered_map<LatticeKey, std::unique_ptr<Node>, LatticeHash>;
struct Lattice {
  double cell_m = 0.1;
  mutable CellMap cells;
  mutable NodeMap nodes;
};

/// A part with its inverse motion.
struct Caster {
  PlacedPart part;
  glm::dmat3 object_from_world{1.0}; ///< rotation only
  glm::dvec3 place{0.0};
  double scale = 1.0;
  BoundingSphere sphere; ///< world
};

Caster make_caster(const PlacedPart& part) {
  Caster c;
  c.part = part;
  const glm::dmat3 linear(part.world_from_object);
  c.scale = std::cbrt(std::fabs(glm::determinant(linear)));
  c.object_from_world = glm::transpose(linear / c.scale);
  c.place = glm::dvec3(part.world_from_object[3]);
  Bounds box;
  for (const glm::vec3& p : part.positions)
    box.include(glm::dvec3(p));
  double radius = 0.0;
  for (const glm::vec3& p : part.positions)
    radius = std::max(radius, glm::length(glm::dvec3(p) - box.centre()));
  if (!box.empty())
    c.sphere = {c.place + linear * box.centre(), c.scale * radius};
  return c;
}

/// A point of the room that an object sees, and the share of the windows' light that the objects keep from it.
struct SeenPoint {
  std::uint32_t triangle = 0;
  glm::dvec3 position{0.0}, direction{0.0};
  float lost_share = 0.0f, weight_sr = 0.0f;
};

/// The room around an object, from eight points of its box.
struct Surround {
  Bounds box; ///< own frame
  std::array<std::vector<SeenPoint>, 8> seen;
  std::array<Sh9Rgb, 8> change{};
};

} // namespace

struct RoomChangeField::State {
  const Room& room;
  const RayScene& rays;
  const RoomLight& room_light;
  std::vector<Aperture> apertures;
  RoomPlanes planes;
  std::vector<Caster> casters;
  std::vector<Surround> surrounds; ///< one per caster
  std::vector<TwoSided> radiance;
  std::vector<DirectionalLight> sun;
  Rgb whole_sun{0.0f};
  std::uint64_t light_number = 0;
  Lattice fine, coarse;
  std::span<const SkyMap> pyramid;
  std::vector<ApertureCell> windows; ///< coarse: what lights the room far from the objects
  mutable PatchMap patches;          ///< hold as long as the room

  State(const Room& r, const RayScene& s, std::span<const Aperture> a, const RoomLight& l)
      : room(r), rays(s), room_light(l), apertures(a.begin(), a.end()), planes(r) {}

  bool cast(std::size_t which, const glm::dvec3& x, const glm::dvec3& w, Covered& hit, double& distance) const;
  void trace_caster(std::size_t which, const glm::dvec3& x, const glm::dvec3& n, int count, Receiver& receiver) const;
  bool sees(const glm::dvec3& a, const glm::dvec3& b) const {
    return !rays.occluded(rays.to_local(a), glm::vec3(b - a), 0.0f, 1.0f);
  }
  bool covered(const glm::dvec3& x, const glm::dvec3& w) const;
  Surround look_around(const Caster& caster) const;
  Sh9Rgb change_of(std::span<const SeenPoint> seen) const;
  Receiver trace(const glm::dvec3& x, const glm::dvec3& n, int count) const;
  /// Past the room; with `objects`, past them too.
  float window_share(const glm::dvec3& x, const glm::dvec3& n, bool objects) const;
  Rgb sun_at(const DirectionalLight& light, const glm::dvec3& x, const glm::dvec3& n) const;
  Rgb reflected_sun(const glm::dvec3& x, const glm::dvec3& n, const Rgb& reflectance) const;
  Patch* patch_at(std::uint32_t triangle, const glm::dvec3& x, const glm::dvec3& direction) const;
  Rgb irradiance_of(Patch& patch) const;
  Rgb radiance_behind(const Covered& c, std::size_t number) const;
  RoomChange lit(const Receiver& receiver, std::uint32_t triangle, const glm::dvec3& x,
                 const glm::dvec3& direction) const;
  Node* node(const Lattice& lattice, const LatticeKey& key) const;
  const Cell& cell(const Lattice& lattice, const LatticeKey& key) const;
  const RoomChange& current(Node& node, const glm::dvec3& x, std::uint32_t triangle, const glm::dvec3& n) const;
  const Lattice& lattice_at(const glm::dvec3& x) const;
};

/// First point of one part along a ray.
bool RoomChangeField::State::cast(std::size_t which, const glm::dvec3& x, const glm::dvec3& w, Covered& hit,
                                  double& distance) const {
  const Caster& c = casters[which];
  const glm::dvec3 origin = c.object_from_world * (x - c.place) / c.scale, direction = c.object_from_world * w;
  RayHit found;
  if (!c.part.rays->closest(c.part.rays->to_local(origin), glm::vec3(direction), 0.0f, kInfinity, found))
    return false;
  const auto& t = c.part.triangles[found.triangle];
  const glm::vec3 a = c.part.positions[t[0]];
  const glm::vec3 area = glm::cross(c.part.positions[t[1]] - a, c.part.positions[t[2]] - a);
  const auto first = static_cast<std::uint32_t>(c.part.first_vertex);
  hit.vertex = {first + t[0], first + t[1], first + t[2]};
  hit.u = found.u;
  hit.v = found.v;
  hit.back = glm::dot(area, glm::vec3(direction)) > 0.0f;
  distance = static_cast<double>(found.distance) * c.scale;
  return true;
}

/// Some object lies in a direction.
bool RoomChangeField::State::covered(const glm::dvec3& x, const glm::dvec3& w) const {
  for (const Caster& c : casters) {
    const glm::dvec3 to = c.sphere.centre - x;
    const double along = glm::dot(to, w), r2 = c.sphere.radius * c.sphere.radius, d2 = glm::dot(to, to);
    if (d2 > r2 && (along <= 0.0 || d2 - along * along > r2))
      continue;
    const glm::dvec3 origin = c.object_from_world * (x - c.place) / c.scale;
    if (c.part.rays->occluded(c.part.rays->to_local(origin), glm::vec3(c.object_from_world * w), 0.0f, kInfinity))
      return true;
  }
  return false;
}

/// The room around an object is looked at as if no object stood there: what hides it is in the transfer vectors.
Surround RoomChangeField::State::look_around(const Caster& caster) const {
  Surround surround;
  for (const glm::vec3& p : caster.part.positions)
    surround.box.include(glm::dvec3(p));
  if (surround.box.empty())
    return surround;
  for (int k = 0; k < 8; ++k) {
    const glm::dvec3 t(k & 1 ? 1 - kInset : kInset, k & 2 ? 1 - kInset : kInset, k & 4 ? 1 - kInset : kInset);
    const glm::dvec3 eye(caster.part.world_from_object * glm::dvec4(surround.box.min + t * surround.box.size(), 1.0));
    for (int i = 0; i < kAround; ++i) {
      const glm::dvec2 u = lattice_point(i, kAround);
      const double z = 1.0 - 2.0 * u.x, r = std::sqrt(std::max(0.0, 1.0 - z * z)), turn = 2.0 * std::numbers::pi * u.y;
      const glm::dvec3 w(r * std::cos(turn), r * std::sin(turn), z);
      RayHit hit;
      if (!rays.closest(rays.to_local(eye), glm::vec3(w), 0.0f, kInfinity, hit))
        continue;
      const glm::dvec3 n = planes[planes.facing_of(hit.triangle, w)].normal;
      const glm::dvec3 position = eye + static_cast<double>(hit.distance) * w;
      if (glm::length(position - caster.sphere.centre) > kSurroundRadii * caster.sphere.radius)
        continue;
      const float lost = window_share(position + kAir * n, n, false) - window_share(position + kAir * n, n, true);
      surround.seen[k].push_back(
          {hit.triangle, position, w, lost, static_cast<float>(4.0 * std::numbers::pi / kAround)});
    }
  }
  return surround;
}

Sh9Rgb RoomChangeField::State::change_of(std::span<const SeenPoint> seen) const {
  Sh9Rgb sum{};
  for (const SeenPoint& p : seen) {
    const RoomPoint point = room_light.at_surface(p.triangle, p.position, p.direction);
    Rgb lost = p.lost_share * point.open_sky_irradiance;
    if (!sun.empty()) {
      DirectionalLight light = sun[sun.size() / 2];
      light.irradiance = whole_sun;
      const glm::dvec3 n = planes[planes.facing_of(p.triangle, p.direction)].normal, x = p.position + kAir * n;
      if (const Rgb arrives = sun_at(light, x, n); arrives != Rgb(0.0f) && covered(x, light.direction))
        lost += arrives;
    }
    const std::array<float, 9> y = sh::evaluate9(glm::vec3(p.direction));
    for (int i = 0; i < 9; ++i)
      sum[i] -= (p.weight_sr * y[i] * std::numbers::inv_pi_v<float>)*point.reflectance * lost;
  }
  return sum;
}

void RoomChangeField::State::trace_caster(std::size_t which, const glm::dvec3& x, const glm::dvec3& n, int count,
                                          Receiver& receiver) const {
  const BoundingSphere& sphere = casters[which].sphere;
  const glm::dvec3 to = sphere.centre - x;
  const double distance = glm::length(to), s = sphere.radius / std::max(distance, 1e-9);
  if (sphere.radius <= 0.0 || glm::dot(n, to) < -sphere.radius)
    return;
  // Close by, the sphere covers most of what x sees: then the whole hemisphere, by its cosine.
  const bool whole = s > 0.98;
  const double cos_max = whole ? 0.0 : std::sqrt(1.0 - s * s);
  const OrthonormalBasis basis(whole ? n : to / distance);
  const glm::dvec3 axis = whole ? n : to / distance;
  for (int k = 0; k < count; ++k) {
    const glm::dvec2 u = lattice_point(k, count);
    const double up = whole ? std::sqrt(1.0 - u.x) : 1.0 - u.x * (1.0 - cos_max);
    const double side = std::sqrt(std::max(0.0, 1.0 - up * up)), turn = 2.0 * std::numbers::pi * u.y;
    const glm::dvec3 w = glm::normalize(side * std::cos(turn) * basis.u + side * std::sin(turn) * basis.v + up * axis);
    const double cosine = glm::dot(n, w);
    Covered hit;
    double at = 0.0, other = 0.0;
    if (cosine <= 0.0 || !cast(which, x, w, hit, at))
      continue;
    bool hidden = false;
    for (std::size_t o = 0; o < casters.size() && !hidden; ++o)
      if (Covered ignored; o != which && cast(o, x, w, ignored, other))
        hidden = other < at;
    RayHit room_hit;
    const bool ends = rays.closest(rays.to_local(x), glm::vec3(w), 0.0f, kInfinity, room_hit);
    if (hidden || (ends && static_cast<double>(room_hit.distance) < at))
      continue;
    hit.weight = static_cast<float>((whole ? std::numbers::pi : 2.0 * std::numbers::pi * (1.0 - cos_max) * cosine) /
                                    static_cast<double>(count));
    if (ends) {
      hit.position = x + static_cast<double>(room_hit.distance) * w;
      hit.behind = patch_at(room_hit.triangle, hit.position, w);
    }
    receiver.covered.push_back(hit);
  }
}

Receiver RoomChangeField::State::trace(const glm::dvec3& x, const glm::dvec3& n, int count) const {
  Receiver receiver;
  for (std::size_t k = 0; k < casters.size(); ++k)
    trace_caster(k, x, n, count, receiver);
  receiver.sky_share = window_share(x, n, false);
  return receiver;
}

/// Share of the windows, weighted by what a uniform sky sends through them, that x sees past the room.
float RoomChangeField::State::window_share(const glm::dvec3& x, const glm::dvec3& n, bool objects) const {
  double seen = 0.0, all = 0.0;
  for (const Aperture& a : apertures)
    for (int i = 0; i < kWindowPoints; ++i)
      for (int j = 0; j < kWindowPoints; ++j) {
        const std::size_t last = a.corners.size() - 1;
        const double s = (i + 0.5) / kWindowPoints, t = (j + 0.5) / kWindowPoints;
        const glm::dvec3 p = (1 - s) * ((1 - t) * a.corners[0] + t * a.corners[last]) +
                             s * ((1 - t) * a.corners[1] + t * a.corners[std::min<std::size_t>(2, last)]);
        const glm::dvec3 d = p - x;
        const double r2 = glm::dot(d, d), weight = -glm::dot(a.inward, d) * glm::dot(n, d) / (r2 * r2);
        if (glm::dot(n, d) <= 0.0 || glm::dot(a.inward, d) >= 0.0)
          continue;
        all += weight;
        if (!rays.occluded(rays.to_local(x), glm::vec3(d), 0.0f, 0.9999f) &&
            !(objects && covered(x, d / std::sqrt(r2))))
          seen += weight;
      }
  return all > 0.0 ? static_cast<float>(seen / all) : 1.0f;
}

Rgb RoomChangeField::State::sun_at(const DirectionalLight& light, const glm::dvec3& x, const glm::dvec3& n) const {
  const double cosine = glm::dot(n, light.direction);
  int crossed = 0;
  if (cosine <= 0.0)
    return Rgb(0.0f);
  const Rgb pane =
      aperture_transmittance(apertures, x, light.direction, std::numeric_limits<double>::infinity(), &crossed);
  if (crossed == 0 || rays.occluded(rays.to_local(x), glm::vec3(light.direction), 0.0f, kInfinity))
    return Rgb(0.0f);
  return static_cast<float>(cosine) * pane * light.irradiance;
}

/// The middle of the patch, or else the first of some points around it, that lies on the room's surface and in its air.
Patch* RoomChangeField::State::patch_at(std::uint32_t triangle, const glm::dvec3& x,
                                        const glm::dvec3& direction) const {
  const std::uint32_t facing = planes.facing_of(triangle, direction);
  const RoomFacing& f = planes[facing];
  const LatticeKey place{static_cast<std::int64_t>(std::floor(glm::dot(f.u, x) / kPatch_m)),
                         static_cast<std::int64_t>(std::floor(glm::dot(f.v, x) / kPatch_m)), facing};
  const std::uint32_t material = room.triangles[triangle].material;
  const LatticeKey key{place.i, place.j, facing * static_cast<std::uint32_t>(room.materials.size()) + material};
  if (const auto found = patches.find(key); found != patches.end())
    return found->second.get();
  auto made = std::make_unique<Patch>();
  made->normal = f.normal;
  made->reflectance = room.materials[material].reflectance;
  for (int k = 0; k < kPatchPoints * kPatchPoints && !made->lit; ++k) {
    const int step = (k + kPatchPoints * kPatchPoints / 2) % (kPatchPoints * kPatchPoints); // the middle first
    const double s = (step % kPatchPoints + 0.5) / kPatchPoints, t = (step / kPatchPoints + 0.5) / kPatchPoints;
    made->point = f.corner(place.i, place.j, kPatch_m) + kPatch_m * (s * f.u + t * f.v);
    RayHit below;
    const glm::dvec3 air = made->point + kAir * f.normal;
    if (!rays.closest(rays.to_local(air), glm::vec3(-f.normal), 0.0f, static_cast<float>(2.0 * kAir), below) ||
        room.triangles[below.triangle].material != material)
      continue;
    made->probes = room_light.probes_at(air);
    made->lit = made->probes.count > 0;
  }
  return patches.emplace(key, std::move(made)).first->second.get();
}

Rgb RoomChangeField::State::irradiance_of(Patch& patch) const {
  if (patch.lit && patch.light_number.load(std::memory_order_acquire) != light_number) {
    const std::lock_guard lock(patch.renewing);
    if (patch.light_number.load(std::memory_order_relaxed) != light_number) {
      patch.irradiance = room_light.indirect_irradiance(patch.normal, patch.probes) +
                         open_sky_irradiance(pyramid, windows, patch.point, patch.normal);
      patch.light_number.store(light_number, std::memory_order_release);
    }
  }
  return patch.irradiance;
}

/// The room's radiance that the object hides.
Rgb RoomChangeField::State::radiance_behind(const Covered& c, std::size_t number) const {
  if (!c.behind)
    return Rgb(0.0f);
  Rgb irradiance = irradiance_of(*c.behind);
  if (!sun.empty()) { // one of the disc's samples stands for all
    DirectionalLight light = sun[number % sun.size()];
    light.irradiance = whole_sun;
    irradiance += sun_at(light, c.position + kAir * c.behind->normal, c.behind->normal);
  }
  return c.behind->reflectance * irradiance * std::numbers::inv_pi_v<float>;
}

RoomChange RoomChangeField::State::lit(const Receiver& receiver, std::uint32_t triangle, const glm::dvec3& x,
                                       const glm::dvec3& direction) const {
  RoomChange change;
  for (std::size_t k = 0; k < receiver.covered.size(); ++k) {
    const Covered& c = receiver.covered[k];
    const float b[3] = {1.0f - c.u - c.v, c.u, c.v};
    Rgb object(0.0f);
    for (int i = 0; i < 3; ++i)
      object += b[i] * (c.back ? radiance[c.vertex[i]].back : radiance[c.vertex[i]].front);
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
    air[k] = f.corner(key.i + (k & 1), key.j + (k >> 1), lattice.cell_m) + kAir * f.normal;
    made->corner[k] = node(lattice, {key.i + (k & 1), key.j + (k >> 1), key.facing});
  }
  made->open = true;
  constexpr int kWays[6][2] = {{0, 3}, {1, 2}, {0, 1}, {2, 3}, {0, 2}, {1, 3}};
  for (const auto& way : kWays)
    made->open = made->open && sees(air[way[0]], air[way[1]]);
  return *lattice.cells.emplace(key, std::move(made)).first->second;
}

const RoomChange& RoomChangeField::State::current(Node& node, const glm::dvec3& x, std::uint32_t triangle,
                                                  const glm::dvec3& n) const {
  std::call_once(node.traced, [&] { node.receiver = trace(x + kAir * n, n, kRays); });
  if (node.light_number.load(std::memory_order_acquire) != light_number) {
    const std::lock_guard lock(node.renewing);
    if (node.light_number.load(std::memory_order_relaxed) != light_number) {
      node.light = lit(node.receiver, triangle, x, -n);
      node.light_number.store(light_number, std::memory_order_release);
    }
  }
  return node.light;
}

const Lattice& RoomChangeField::State::lattice_at(const glm::dvec3& x) const {
  for (const Caster& c : casters)
    if (glm::length(x - c.sphere.centre) < kNear * c.sphere.radius)
      return fine;
  return coarse;
}

RoomChangeField::RoomChangeField(const Room& room, const RayScene& room_rays, std::span<const Aperture> apertures,
                                 const RoomLight& room_light)
    : state_(std::make_unique<State>(room, room_rays, apertures, room_light)) {}
RoomChangeField::RoomChangeField(RoomChangeField&&) noexcept = default;
RoomChangeField& RoomChangeField::operator=(RoomChangeField&&) noexcept = default;
RoomChangeField::~RoomChangeField() = default;

void RoomChangeField::set_objects(std::vector<PlacedPart> parts) {
  State& s = *state_;
  s.casters.clear();
  double smallest = std::numeric_limits<double>::infinity();
  for (const PlacedPart& part : parts) {
    s.casters.push_back(make_caster(part));
    smallest = std::min(smallest, std::max(s.casters.back().sphere.radius, 1e-3));
  }
  s.surrounds.assign(s.casters.size(), {});
  tbb::parallel_for(std::size_t{0}, s.casters.size(),
                    [&](std::size_t k) { s.surrounds[k] = s.look_around(s.casters[k]); });
  for (Lattice* lattice : {&s.fine, &s.coarse}) {
    lattice->cells.clear();
    lattice->nodes.clear();
  }
  s.fine.cell_m = s.casters.empty() ? 1.0 : kFineShare * smallest;
  s.coarse.cell_m = 4.0 * s.fine.cell_m;
}

/// The sun's light on one side of an object's surface, reflected.
Rgb RoomChangeField::State::reflected_sun(const glm::dvec3& x, const glm::dvec3& n, const Rgb& reflectance) const {
  DirectionalLight light = sun[sun.size() / 2];
  light.irradiance = whole_sun;
  const Rgb irradiance = sun_at(light, x + kAir * n, n);
  if (irradiance == Rgb(0.0f))
    return irradiance;
  double skin = kAir;
  for (const Caster& c : casters)
    skin = std::max(skin, kSkin * c.sphere.radius);
  if (covered(x + skin * n, light.direction))
    return Rgb(0.0f);
  return reflectance * irradiance * std::numbers::inv_pi_v<float>;
}

void RoomChangeField::set_sky(std::span<const SkyMap> pyramid, const std::optional<DetectedSun>& detected) {
  State& s = *state_;
  s.pyramid = pyramid;
  s.windows =
      aperture_cells(s.apertures, {s.room.bounds().empty() ? glm::dvec3(0.0) : s.room.bounds().centre(), 0.0}, pyramid);
  // Every sun counts, also one that does not reach the objects: they may stand before a patch of it.
  s.whole_sun = detected ? detected->normal_irradiance : Rgb(0.0f);
  s.sun.clear();
  for (int k = 0; detected && k < kSunSamples; ++k)
    s.sun.push_back({sun_disc_direction(detected->direction, k, kSunSamples), s.whole_sun / float{kSunSamples}});
  tbb::parallel_for(std::size_t{0}, s.surrounds.size(), [&](std::size_t k) {
    for (int c = 0; c < 8; ++c)
      s.surrounds[k].change[c] = s.change_of(s.surrounds[k].seen[c]);
  });
}

Sh9Rgb RoomChangeField::arriving_change(std::size_t part, const glm::dvec3& x) const {
  const Caster& caster = state_->casters[part];
  const Surround& surround = state_->surrounds[part];
  const glm::dvec3 local = caster.object_from_world * (x - caster.place) / caster.scale;
  const glm::dvec3 size = glm::max(surround.box.size(), glm::dvec3(1e-9));
  const glm::dvec3 t = glm::clamp(((local - surround.box.min) / size - kInset) / (1.0 - 2.0 * kInset), 0.0, 1.0);
  Sh9Rgb sum{};
  for (int k = 0; k < 8; ++k) {
    const double weight = (k & 1 ? t.x : 1 - t.x) * (k & 2 ? t.y : 1 - t.y) * (k & 4 ? t.z : 1 - t.z);
    for (int i = 0; i < 9; ++i)
      sum[i] += static_cast<float>(weight) * surround.change[k][i];
  }
  return sum;
}

void RoomChangeField::set_light(std::vector<TwoSided> radiance, std::span<const glm::dvec3> positions,
                                std::span<const glm::vec3> normals, std::span<const Rgb> reflectance) {
  State& s = *state_;
  s.radiance = std::move(radiance);
  if (!s.sun.empty())
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
  return std::any_of(state_->casters.begin(), state_->casters.end(), [&](const Caster& c) {
    const glm::dvec3 d = c.sphere.centre - x;
    return c.sphere.radius * c.sphere.radius > kLeastShare * glm::dot(d, d);
  });
}

RoomChange RoomChangeField::at(std::uint32_t triangle, const glm::dvec3& x, const glm::dvec3& direction) const {
  const State& s = *state_;
  const std::uint32_t facing = s.planes.facing_of(triangle, direction);
  const RoomFacing& f = s.planes[facing];
  const Lattice& lattice = s.lattice_at(x);
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
    if (!cell.open && !s.sees(x + kAir * f.normal, corner + kAir * f.normal))
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
  return s.lit(s.trace(x + kAir * n, n, count), triangle, x, direction);
}

Rgb RoomChangeField::sun_irradiance(std::uint32_t triangle, const glm::dvec3& x, const glm::dvec3& direction) const {
  const State& s = *state_;
  const glm::dvec3 n = s.planes[s.planes.facing_of(triangle, direction)].normal;
  Rgb sum(0.0f);
  for (const DirectionalLight& l : s.sun)
    sum += s.sun_at(l, x + kAir * n, n);
  return sum;
}

std::uint32_t RoomChangeField::facing_of(std::uint32_t triangle, const glm::dvec3& direction) const {
  return state_->planes.facing_of(triangle, direction);
}

} // namespace daylit
