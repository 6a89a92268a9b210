#include "runtime/indirect/room_light.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <limits>
#include <mutex>
#include <utility>

#include <glm/common.hpp>
#include <tbb/concurrent_unordered_map.h>

#include "runtime/indirect/room_planes.h"
#include "runtime/object/relight.h"
#include "scene/core/parallel.h"

namespace daylit {

namespace {

struct CornerLight {
  Rgb indirect{0.0f}, open_sky{0.0f};
};

constexpr int kSide = 3, kCorners = (kSide + 1) * (kSide + 1); // cells and their corners of a block

/// Neighbouring cells share their corners, which fill the lanes of one evaluation.
struct Block {
  std::array<bool, kSide * kSide> open{}; ///< per cell: all corners lie in the same air
  std::array<VertexProbes, kCorners> probes{};
  std::array<CornerLight, kCorners> light{};
  std::atomic<std::uint64_t> frame{0}; ///< that `light` belongs to
  std::mutex renewing;
};

constexpr int corner_of(int i, int j) { return j * (kSide + 1) + i; }

/// The block that cell i of the lattice lies in, and which of its cells that is, along one axis.
struct CellInBlock {
  std::int64_t block = 0;
  int cell = 0;
};
CellInBlock in_block(std::int64_t i) {
  const std::int64_t cell = ((i % kSide) + kSide) % kSide;
  return {(i - cell) / kSide, static_cast<int>(cell)};
}

} // namespace

struct RoomLight::State {
  const Room& room;
  const RayScene& rays;
  const LightFieldSampler& sampler;
  const LightField* field = nullptr;
  std::span<const SkyMap> pyramid;
  std::vector<ApertureCell> apertures;
  Rgb sun_normal_irradiance{0.0f};
  std::uint64_t frame = 0, sky_version = 0;
  RoomPlanes planes;
  mutable tbb::concurrent_unordered_map<LatticeKey, std::unique_ptr<Block>, LatticeHash> blocks;

  State(const Room& r, const RayScene& s, const LightFieldSampler& l) : room(r), rays(s), sampler(l), planes(r) {}
  Rgb indirect_at(const glm::dvec3& n, const VertexProbes& probes) const;
  glm::dvec3 corner(const LatticeKey& key, int index) const;
  std::unique_ptr<Block> make_block(const LatticeKey& key) const;
  void renew(const LatticeKey& key, Block& block) const;
  const Block& current_block(const LatticeKey& key) const;
  RoomPoint point(std::uint32_t triangle, const CornerLight& light) const;
};

/// E = sum_lm A_l L_lm Y_lm(n), L_lm = sum_k w_k L_lm,k of the probes around (Ramamoorthi & Hanrahan 2001). Ringing
/// below zero is cut.
Rgb RoomLight::State::indirect_at(const glm::dvec3& n, const VertexProbes& probes) const {
  if (probes.count == 0)
    return Rgb(0.0f);
  Sh9Rgb coefficients{};
  for (int k = 0; k < probes.count; ++k)
    for (int c = 0; c < 9; ++c)
      coefficients[c] += probes.weight[k] * field->probe[probes.probe[k]][c];
  return glm::max(irradiance(coefficients, glm::vec3(n)), Rgb(0.0f));
}

glm::dvec3 RoomLight::State::corner(const LatticeKey& key, int index) const {
  return planes[key.facing].corner(kSide * key.i + index % (kSide + 1), kSide * key.j + index / (kSide + 1),
                                   kRoomLightCell_m);
}

/// A cell is open where all four corners have probes and see each other: then no edge of light crosses it unseen.
std::unique_ptr<Block> RoomLight::State::make_block(const LatticeKey& key) const {
  auto block = std::make_unique<Block>();
  std::array<glm::dvec3, kCorners> air;
  for (int k = 0; k < kCorners; ++k) {
    air[k] = corner(key, k) + kAirGap_m * planes[key.facing].normal;
    block->probes[k].count = sampler.weights(air[k], block->probes[k].probe, block->probes[k].weight);
  }
  for (int j = 0; j < kSide; ++j)
    for (int i = 0; i < kSide; ++i) {
      const std::array<int, 4> around{corner_of(i, j), corner_of(i + 1, j), corner_of(i, j + 1),
                                      corner_of(i + 1, j + 1)};
      const bool lit = std::ranges::all_of(around, [&](int k) { return block->probes[k].count > 0; });
      const bool open = lit && see_each_other(rays, {air[around[0]], air[around[1]], air[around[2]], air[around[3]]});
      block->open[j * kSide + i] = open;
    }
  return block;
}

/// The window integral takes all corners at once.
void RoomLight::State::renew(const LatticeKey& key, Block& block) const {
  std::array<glm::dvec3, kCorners> x;
  std::array<glm::vec3, kCorners> n;
  n.fill(glm::vec3(planes[key.facing].normal));
  for (int k = 0; k < kCorners; ++k)
    x[k] = corner(key, k);
  const std::vector<Rgb> open_sky = open_sky_irradiance(pyramid, apertures, x, n);
  for (int k = 0; k < kCorners; ++k)
    block.light[k] = {indirect_at(planes[key.facing].normal, block.probes[k]), open_sky[k]};
}

/// Renewed by the first thread that needs it; the others wait.
const Block& RoomLight::State::current_block(const LatticeKey& key) const {
  auto found = blocks.find(key);
  if (found == blocks.end())
    found = blocks.emplace(key, make_block(key)).first; // two threads may make it: the same block, one is kept
  Block& block = *found->second;
  if (block.frame.load(std::memory_order_acquire) == frame)
    return block;
  const std::lock_guard lock(block.renewing);
  if (block.frame.load(std::memory_order_relaxed) == frame)
    return block;
  renew(key, block);
  block.frame.store(frame, std::memory_order_release);
  return block;
}

RoomPoint RoomLight::State::point(std::uint32_t triangle, const CornerLight& light) const {
  // The visibilities of the sun carry its cosine and the mean transmittance of the pane.
  return {light.indirect, light.open_sky, sun_normal_irradiance, room.material(room.triangles[triangle]).reflectance};
}

RoomLight::RoomLight(const Room& room, const RayScene& room_rays, const LightFieldSampler& sampler)
    : state_(std::make_unique<State>(room, room_rays, sampler)) {}
RoomLight::RoomLight(RoomLight&&) noexcept = default;
RoomLight& RoomLight::operator=(RoomLight&&) noexcept = default;
RoomLight::~RoomLight() = default;

/// The sun's lights carry their cosine and pane later, per pixel: here is their sum.
void RoomLight::set_frame(const LightField& field, std::span<const SkyMap> pyramid, std::span<const ApertureCell> cells,
                          const LightSet& lights, std::uint64_t sky_version) {
  State& s = *state_;
  s.field = &field;
  s.pyramid = pyramid;
  const bool same_sky = std::exchange(s.sky_version, sky_version) == sky_version && sky_version != 0;
  if (!same_sky || !std::ranges::equal(s.apertures, cells)) {
    s.apertures.assign(cells.begin(), cells.end());
    ++s.frame;
  }
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

/// The plane n.x = h is met after t = (h - n.eye) / (n.w).
std::optional<RoomPoint> RoomLight::at_plane(std::uint32_t triangle, const glm::dvec3& eye,
                                             const glm::dvec3& direction) const {
  const RoomPlanes& planes = state_->planes;
  const RoomFacing& plane = planes[planes.facing_of(triangle, direction)];
  const double t = (plane.height - glm::dot(plane.normal, eye)) / glm::dot(plane.normal, direction);
  if (!(t > 0.0 && std::isfinite(t)))
    return at(eye, direction); // seen at its edge only
  return at_surface(triangle, eye + t * direction, direction);
}

/// Bilinear between the corners of an open cell.
RoomPoint RoomLight::at_surface(std::uint32_t triangle, const glm::dvec3& x, const glm::dvec3& direction) const {
  const State& s = *state_;
  const std::uint32_t facing = s.planes.facing_of(triangle, direction);
  const LatticeSquare square = s.planes[facing].square(x, kRoomLightCell_m);
  const CellInBlock i = in_block(square.i), j = in_block(square.j);
  const Block& block = s.current_block({i.block, j.block, facing});
  if (!block.open[j.cell * kSide + i.cell])
    return evaluate(triangle, x, direction);
  CornerLight light;
  for (int k = 0; k < 4; ++k) {
    const CornerLight& corner = block.light[corner_of(i.cell + (k & 1), j.cell + (k >> 1))];
    light.indirect += square.weight[k] * corner.indirect;
    light.open_sky += square.weight[k] * corner.open_sky;
  }
  return s.point(triangle, light);
}

RoomPoint RoomLight::evaluate(std::uint32_t triangle, const glm::dvec3& x, const glm::dvec3& direction) const {
  const State& s = *state_;
  const glm::dvec3 n = s.planes[s.planes.facing_of(triangle, direction)].normal;
  VertexProbes probes;
  probes.count = s.sampler.weights(x + kAirGap_m * n, probes.probe, probes.weight);
  const glm::vec3 normal(n);
  return s.point(
      triangle, {s.indirect_at(n, probes), open_sky_irradiance(s.pyramid, s.apertures, {&x, 1}, {&normal, 1}).front()});
}

/// Alone without tasks: who asks for one point may hold a lock.
void RoomLight::evaluate(std::span<const KnownPoint* const> points, std::span<const ApertureCell> windows,
                         std::span<RoomPoint> light) const {
  constexpr std::size_t kAtOnce = 16;
  const State& s = *state_;
  const auto some = [&](std::size_t chunk) {
    const std::size_t first = chunk * kAtOnce, count = std::min(kAtOnce, points.size() - first);
    std::array<glm::dvec3, kAtOnce> x;
    std::array<glm::vec3, kAtOnce> n;
    for (std::size_t k = 0; k < count; ++k) {
      x[k] = points[first + k]->x;
      n[k] = glm::vec3(points[first + k]->n);
    }
    const std::vector<Rgb> open_sky = open_sky_irradiance(s.pyramid, windows, {x.data(), count}, {n.data(), count});
    for (std::size_t k = 0; k < count; ++k) {
      const KnownPoint& p = *points[first + k];
      light[first + k] = s.point(p.triangle, {s.indirect_at(p.n, p.probes), open_sky[k]});
    }
  };
  if (points.size() == 1)
    some(0);
  else
    parallel_for(std::size_t{0}, (points.size() + kAtOnce - 1) / kAtOnce, some);
}

VertexProbes RoomLight::probes_at(const glm::dvec3& x) const {
  VertexProbes probes;
  probes.count = state_->sampler.weights(x, probes.probe, probes.weight);
  return probes;
}

Rgb RoomLight::indirect_irradiance(const glm::dvec3& n, const VertexProbes& probes) const {
  return state_->indirect_at(n, probes);
}

const glm::dvec3& RoomLight::normal(std::uint32_t triangle, const glm::dvec3& direction) const {
  return state_->planes[state_->planes.facing_of(triangle, direction)].normal;
}

std::size_t RoomLight::cells_kept() const { return kSide * kSide * state_->blocks.size(); }

} // namespace daylit
