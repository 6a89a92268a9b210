#include "runtime/light/room_light.h"

#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <tbb/concurrent_unordered_map.h>

#include "runtime/light/relight.h"
#include "runtime/light/room_planes.h"

namespace daylit {

namespace {

// Probes answer for the air: a point on a wall is asked for this far in front of it, metres.
constexpr double kAir = 1e-3;

struct CornerLight {
  Rgb indirect{0.0f}, open_sky{0.0f};
};

struct Cell {
  bool open = false; ///< all corners lie in the same air
  std::array<VertexProbes, 4> probes{};
  std::array<CornerLight, 4> light{};
  std::atomic<std::uint64_t> frame{0}; ///< that `light` belongs to
  std::mutex renewing;
};

} // namespace

struct RoomLight::State {
  const Room& room;
  const RayScene& rays;
  const LightFieldSampler& sampler;
  const LightField* field = nullptr;
  std::span<const SkyMap> pyramid;
  std::span<const ApertureCell> apertures;
  Rgb sun_normal_irradiance{0.0f};
  std::uint64_t frame = 0;
  RoomPlanes planes;
  mutable tbb::concurrent_unordered_map<LatticeKey, std::unique_ptr<Cell>, LatticeHash> cells;

  State(const Room& r, const RayScene& s, const LightFieldSampler& l) : room(r), rays(s), sampler(l), planes(r) {}
  Rgb indirect_at(const glm::dvec3& n, const VertexProbes& probes) const;
  std::unique_ptr<Cell> make_cell(const LatticeKey& key) const;
  const Cell& current_cell(const LatticeKey& key) const;
  RoomPoint point(std::uint32_t triangle, const CornerLight& light) const;
};

Rgb RoomLight::State::indirect_at(const glm::dvec3& n, const VertexProbes& probes) const {
  if (probes.count == 0)
    return Rgb(0.0f);
  Sh9Rgb coefficients{};
  for (int k = 0; k < probes.count; ++k)
    for (int c = 0; c < 9; ++c)
      coefficients[c] += probes.weight[k] * field->probe[probes.probe[k]][c];
  return glm::max(irradiance(coefficients, glm::vec3(n)), Rgb(0.0f));
}

std::unique_ptr<Cell> RoomLight::State::make_cell(const LatticeKey& key) const {
  auto cell = std::make_unique<Cell>();
  const RoomFacing& f = planes[key.facing];
  glm::dvec3 air[4];
  cell->open = true;
  for (int k = 0; k < 4; ++k) {
    air[k] = f.corner(key.i + (k & 1), key.j + (k >> 1), kRoomLightCell_m) + kAir * f.normal;
    cell->probes[k].count = sampler.weights(air[k], cell->probes[k].probe, cell->probes[k].weight);
    cell->open = cell->open && cell->probes[k].count > 0;
  }
  constexpr int kWays[6][2] = {{0, 3}, {1, 2}, {0, 1}, {2, 3}, {0, 2}, {1, 3}};
  for (const auto& way : kWays)
    cell->open =
        cell->open && !rays.occluded(rays.to_local(air[way[0]]), glm::vec3(air[way[1]] - air[way[0]]), 0.0f, 1.0f);
  return cell;
}

const Cell& RoomLight::State::current_cell(const LatticeKey& key) const {
  auto found = cells.find(key);
  if (found == cells.end())
    found = cells.emplace(key, make_cell(key)).first; // two threads may make it: the same cell, one is kept
  Cell& cell = *found->second;
  if (!cell.open || cell.frame.load(std::memory_order_acquire) == frame)
    return cell;
  const std::lock_guard lock(cell.renewing);
  if (cell.frame.load(std::memory_order_relaxed) == frame)
    return cell;
  const RoomFacing& f = planes[key.facing];
  std::array<glm::dvec3, 4> corner;
  std::array<glm::vec3, 4> normal;
  for (int k = 0; k < 4; ++k) {
    corner[k] = f.corner(key.i + (k & 1), key.j + (k >> 1), kRoomLightCell_m);
    normal[k] = glm::vec3(f.normal);
  }
  const std::vector<Rgb> open_sky = open_sky_irradiance(pyramid, apertures, corner, normal);
  for (int k = 0; k < 4; ++k)
    cell.light[k] = {indirect_at(f.normal, cell.probes[k]), open_sky[k]};
  cell.frame.store(frame, std::memory_order_release);
  return cell;
}

RoomPoint RoomLight::State::point(std::uint32_t triangle, const CornerLight& light) const {
  // The shares of the sun carry its cosine and the mean transmittance of the pane.
  return {light.indirect, light.open_sky, sun_normal_irradiance, room.material(room.triangles[triangle]).reflectance};
}

RoomLight::RoomLight(const Room& room, const RayScene& room_rays, const LightFieldSampler& sampler)
    : state_(std::make_unique<State>(room, room_rays, sampler)) {}
RoomLight::RoomLight(RoomLight&&) noexcept = default;
RoomLight& RoomLight::operator=(RoomLight&&) noexcept = default;
RoomLight::~RoomLight() = default;

void RoomLight::set_frame(const LightField& field, std::span<const SkyMap> pyramid, std::span<const ApertureCell> cells,
                          const LightSet& lights) {
  State& s = *state_;
  s.field = &field;
  s.pyramid = pyramid;
  s.apertures = cells;
  ++s.frame;
  s.sun_normal_irradiance = Rgb(0.0f);
  for (const DirectionalLight& l : lights.sun)
    s.sun_normal_irradiance += l.irradiance;
}

std::optional<RoomPoint> RoomLight::at(const glm::dvec3& eye, const glm::dvec3& direction) const {
  const RayScene& rays = state_->rays;
  RayHit hit;
  if (!rays.closest(rays.to_local(eye), glm::vec3(direction), 0.0f, std::numeric_limits<float>::infinity(), hit))
    return std::nullopt;
  return at_surface(hit.triangle, eye + static_cast<double>(hit.distance) * direction, direction);
}

RoomPoint RoomLight::at_surface(std::uint32_t triangle, const glm::dvec3& x, const glm::dvec3& direction) const {
  const State& s = *state_;
  const std::uint32_t facing = s.planes.facing_of(triangle, direction);
  const RoomFacing& f = s.planes[facing];
  const glm::dvec2 p(glm::dot(f.u, x) / kRoomLightCell_m, glm::dot(f.v, x) / kRoomLightCell_m);
  const glm::dvec2 lower = glm::floor(p);
  const Cell& cell = s.current_cell({static_cast<std::int64_t>(lower.x), static_cast<std::int64_t>(lower.y), facing});
  if (!cell.open)
    return evaluate(triangle, x, direction);
  const glm::vec2 t(p - lower);
  const float weight[4] = {(1 - t.x) * (1 - t.y), t.x * (1 - t.y), (1 - t.x) * t.y, t.x * t.y};
  CornerLight light;
  for (int k = 0; k < 4; ++k) {
    light.indirect += weight[k] * cell.light[k].indirect;
    light.open_sky += weight[k] * cell.light[k].open_sky;
  }
  return s.point(triangle, light);
}

RoomPoint RoomLight::evaluate(std::uint32_t triangle, const glm::dvec3& x, const glm::dvec3& direction) const {
  const State& s = *state_;
  const glm::dvec3 n = s.planes[s.planes.facing_of(triangle, direction)].normal;
  VertexProbes probes;
  probes.count = s.sampler.weights(x + kAir * n, probes.probe, probes.weight);
  return s.point(triangle, {s.indirect_at(n, probes), open_sky_irradiance(s.pyramid, s.apertures, x, n)});
}

VertexProbes RoomLight::probes_at(const glm::dvec3& x) const {
  VertexProbes probes;
  probes.count = state_->sampler.weights(x, probes.probe, probes.weight);
  return probes;
}

Rgb RoomLight::indirect_irradiance(const glm::dvec3& n, const VertexProbes& probes) const {
  return state_->indirect_at(n, probes);
}

std::size_t RoomLight::cells_kept() const { return state_->cells.size(); }

} // namespace daylit
