#include <algorithm>
#include <cmath>
#include <numeric>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "scene/room/aperture.h"
#include "scene/room/ray_scene.h"
#include "scene/volume/probe_planes.h"
#include "scene/volume/volume.h"

namespace daylit {

namespace {

constexpr double kTouch_m = 1e-4;     // surfaces nearer than this to the point do not hide probes from it
constexpr float kLeastWeight = 1e-6f; // below it the visible corners say too little about the point

/// A box and a plane: the box reaches sum_k half_k |normal_k| from its centre towards the plane (separating axis).
bool plane_misses_box(const glm::dvec3& centre, const glm::dvec3& half, const glm::dvec3& corner,
                      const glm::dvec3& normal) {
  const double reach = glm::dot(half, glm::abs(normal));
  return std::abs(glm::dot(centre - corner, normal)) > reach;
}

} // namespace

struct LightFieldSampler::State {
  std::vector<glm::vec3> positions;
  std::vector<std::uint8_t> valid; ///< or interpolated
  glm::dvec3 origin{0.0};          ///< of the positions
  RayScene scene;
  std::vector<Aperture> apertures;
  double touch_m = kTouch_m;

  bool is_grid = false;
  ProbePlanes planes; ///< grid
  glm::ivec3 count{0};
  std::vector<std::uint8_t> open_cell; ///< all corners valid and no surface or aperture in the cell: needs no rays
  std::vector<std::uint32_t> by_x;     ///< free points, sorted by x

  glm::ivec3 cell_count() const { return glm::max(count - 1, glm::ivec3(1)); }
  std::uint32_t probe_index(const glm::ivec3& i) const {
    return static_cast<std::uint32_t>(i.x + count.x * (i.y + count.y * i.z));
  }
  std::size_t cell_index(const glm::ivec3& i) const {
    const glm::ivec3 n = cell_count();
    return static_cast<std::size_t>(i.x) + static_cast<std::size_t>(n.x) * (i.y + static_cast<std::size_t>(n.y) * i.z);
  }

  bool sees(const glm::dvec3& p, std::uint32_t probe) const;
  void find_open_cells(const Room& room);
  void close_cells(std::span<const glm::dvec3> polygon);
  int corner_weights(const GridPosition& at, const glm::dvec3& p, bool open, std::uint32_t* probe, float* weight) const;
  int ring_weights(const GridPosition& at, const glm::dvec3& p, std::uint32_t* probe, float* weight) const;
  int free_point(const glm::dvec3& p, std::uint32_t* probe, float* weight) const;
};

/// Nothing stands on the segment from the point to the probe, beyond `touch_m` of the point: neither a surface nor an
/// aperture.
bool LightFieldSampler::State::sees(const glm::dvec3& p, std::uint32_t probe) const {
  const glm::dvec3 way = origin + glm::dvec3(positions[probe]) - p;
  const double distance = glm::length(way);
  if (distance <= touch_m)
    return true;
  if (scene.occluded(scene.to_local(p), glm::vec3(way), static_cast<float>(touch_m / distance), 1.0f))
    return false;
  if (apertures.empty())
    return true;
  int crossed = 0;
  const glm::dvec3 d = way / distance;
  aperture_transmittance(apertures, p + touch_m * d, d, distance - touch_m, &crossed);
  return crossed == 0;
}

// Trilinear weights of the valid, visible corners: the product over the axes of f or 1 - f, f: how far into the cell.
// Corners without weight count only when no other is visible: the point then stands on the border of the grid and the
// light comes from further in.
int LightFieldSampler::State::corner_weights(const GridPosition& at, const glm::dvec3& p, bool open,
                                             std::uint32_t* probe, float* weight) const {
  std::array<std::uint32_t, 8> idle{};
  int used = 0, idle_count = 0;
  for (int k = 0; k < 8; ++k) {
    const glm::ivec3 step(k & 1, k >> 1 & 1, k >> 2 & 1);
    const glm::ivec3 i = at.cell + step;
    if (i.x >= count.x || i.y >= count.y || i.z >= count.z)
      continue;
    const glm::dvec3 w = glm::mix(1.0 - at.fraction, at.fraction, glm::dvec3(step));
    const std::uint32_t index = probe_index(i);
    const auto corner_weight = static_cast<float>(w.x * w.y * w.z);
    if (corner_weight < kLeastWeight) {
      idle[idle_count++] = index;
    } else if (open || (valid[index] && sees(p, index))) {
      probe[used] = index;
      weight[used++] = corner_weight;
    }
  }
  for (int k = 0; used == 0 && k < idle_count; ++k)
    if (valid[idle[k]] && sees(p, idle[k])) {
      probe[0] = idle[k];
      weight[0] = 1.0f;
      used = 1;
    }
  return used;
}

// The nearest visible probes one ring around the cell, by inverse squared distance (Shepard 1968): narrow gaps between
// furniture.
int LightFieldSampler::State::ring_weights(const GridPosition& at, const glm::dvec3& p, std::uint32_t* probe,
                                           float* weight) const {
  std::array<std::pair<double, std::uint32_t>, 64> near;
  int candidates = 0;
  const glm::ivec3 low = glm::max(at.cell - 1, glm::ivec3(0)), high = glm::min(at.cell + 2, count - 1);
  for (int z = low.z; z <= high.z; ++z)
    for (int y = low.y; y <= high.y; ++y)
      for (int x = low.x; x <= high.x; ++x)
        if (const std::uint32_t index = probe_index({x, y, z}); valid[index])
          near[candidates++] = {glm::distance(origin + glm::dvec3(positions[index]), p), index};
  std::sort(near.begin(), near.begin() + candidates);
  int used = 0;
  for (int k = 0; k < candidates && used < 8; ++k)
    if (sees(p, near[k].second)) {
      probe[used] = near[k].second;
      weight[used++] = static_cast<float>(1.0 / std::max(near[k].first * near[k].first, 1e-12));
    }
  return used;
}

/// The nearest valid probe within kTouch_m, found by its x coordinate.
int LightFieldSampler::State::free_point(const glm::dvec3& p, std::uint32_t* probe, float* weight) const {
  const glm::dvec3 local = p - origin;
  auto it = std::lower_bound(by_x.begin(), by_x.end(), local.x - kTouch_m,
                             [this](std::uint32_t i, double x) { return static_cast<double>(positions[i].x) < x; });
  double nearest = kTouch_m;
  int used = 0;
  for (; it != by_x.end() && static_cast<double>(positions[*it].x) <= local.x + kTouch_m; ++it) {
    const double distance = glm::distance(glm::dvec3(positions[*it]), local);
    if (!valid[*it] || distance > nearest)
      continue;
    nearest = distance;
    probe[0] = *it;
    weight[0] = 1.0f;
    used = 1;
  }
  return used;
}

/// Takes the flag from every cell whose box the polygon's box and plane touch: conservative.
void LightFieldSampler::State::close_cells(std::span<const glm::dvec3> polygon) {
  Bounds bounds;
  for (const glm::dvec3& p : polygon)
    bounds.include(p);
  glm::ivec3 low(0), high(0);
  for (int k = 0; k < 3; ++k) {
    const int last = cell_count()[k] - 1;
    low[k] = std::max(planes.below(k, bounds.min[k] - touch_m), 0);
    high[k] = std::min(planes.below(k, bounds.max[k] + touch_m), last);
    if (high[k] < 0 || low[k] > last)
      return;
  }
  glm::dvec3 normal = glm::cross(polygon[1] - polygon[0], polygon[2] - polygon[0]);
  normal /= std::max(glm::length(normal), 1e-300);
  for (int z = low.z; z <= high.z; ++z)
    for (int y = low.y; y <= high.y; ++y)
      for (int x = low.x; x <= high.x; ++x) {
        glm::dvec3 centre, half;
        for (int k = 0; k < 3; ++k) {
          const double* at = planes.along(k).data() + glm::ivec3(x, y, z)[k];
          centre[k] = origin[k] + 0.5 * (at[0] + at[1]);
          half[k] = 0.5 * (at[1] - at[0]) + touch_m;
        }
        if (!plane_misses_box(centre, half, polygon[0], normal))
          open_cell[cell_index({x, y, z})] = 0;
      }
}

/// Cells in which all eight corners are valid and nothing stands: every point of them sees every corner.
void LightFieldSampler::State::find_open_cells(const Room& room) {
  const glm::ivec3 n = cell_count();
  open_cell.assign(static_cast<std::size_t>(n.x) * n.y * n.z, 0);
  if (count.x < 2 || count.y < 2 || count.z < 2)
    return;
  for (int z = 0; z < n.z; ++z)
    for (int y = 0; y < n.y; ++y)
      for (int x = 0; x < n.x; ++x) {
        bool all = true;
        for (int k = 0; k < 8; ++k)
          all = all && valid[probe_index({x + (k & 1), y + (k >> 1 & 1), z + (k >> 2 & 1)})] != 0;
        open_cell[cell_index({x, y, z})] = all ? 1 : 0;
      }
  for (const RoomTriangle& t : room.triangles) {
    const std::array<glm::dvec3, 3> corners{room.corner(t, 0), room.corner(t, 1), room.corner(t, 2)};
    close_cells(corners);
  }
  for (const Aperture& a : apertures)
    close_cells(a.corners);
}

namespace {

/// L_lm(x) = sum_k weight_k L_lm(probe_k); the weights add up to 1.
std::array<Rgb, 9> mean_of(const std::vector<std::array<Rgb, 9>>& probes, const std::array<std::uint32_t, 8>& probe,
                           const std::array<float, 8>& weight, int used) {
  std::array<Rgb, 9> sum{};
  for (std::size_t k = 0; k < static_cast<std::size_t>(used); ++k)
    for (std::size_t i = 0; i < 9; ++i)
      sum[i] += weight[k] * probes[probe[k]][i];
  return sum;
}

} // namespace

Result<LightFieldSampler> LightFieldSampler::make(const BasisVolume& volume) {
  const ProbeSet& probes = volume.probes;
  if (probes.size() == 0 || probes.valid.size() != probes.size())
    return Error{ErrorCode::file_malformed, "no probes, or their validity is missing", "volume", "bake it again"};
  auto state = std::make_shared<State>();
  state->positions = probes.positions;
  state->valid = probes.valid;
  for (std::size_t i = 0; i < probes.interpolated.size(); ++i)
    if (probes.interpolated[i] != 0)
      state->valid[i] = 1;
  state->origin = probes.origin;
  state->apertures = volume.apertures;
  Result<RayScene> scene = RayScene::build(volume.room);
  if (!scene)
    return scene.error();
  state->scene = std::move(*scene);
  state->touch_m = std::max(kTouch_m, 4.0 * static_cast<double>(state->scene.surface_offset()));
  state->is_grid = probes.is_grid;
  if (probes.is_grid) {
    if (const Result<void> good = check_grid(probes); !good)
      return good.error();
    state->count = probes.count;
    state->planes = ProbePlanes(probes);
    state->find_open_cells(volume.room);
  } else {
    state->by_x.resize(probes.size());
    std::iota(state->by_x.begin(), state->by_x.end(), 0u);
    std::sort(state->by_x.begin(), state->by_x.end(),
              [&](std::uint32_t a, std::uint32_t b) { return probes.positions[a].x < probes.positions[b].x; });
  }
  LightFieldSampler sampler;
  sampler.state_ = std::move(state);
  return sampler;
}

int LightFieldSampler::weights(const glm::dvec3& p, std::span<std::uint32_t, 8> probe,
                               std::span<float, 8> weight) const {
  const State& s = *state_;
  if (!(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)))
    return 0;
  if (!s.is_grid)
    return s.free_point(p, probe.data(), weight.data());
  const GridPosition at = s.planes.locate(p);
  const bool open = !at.clamped && s.open_cell[s.cell_index(at.cell)] != 0;
  int used = s.corner_weights(at, p, open, probe.data(), weight.data());
  if (used == 0)
    used = s.ring_weights(at, p, probe.data(), weight.data());
  float sum = 0.0f;
  for (int k = 0; k < used; ++k)
    sum += weight[k];
  for (int k = 0; k < used; ++k)
    weight[k] /= sum;
  return used;
}

/// Nothing where no probe is visible: outside, or inside furniture.
std::optional<Sh9Rgb> LightFieldSampler::sample(const LightField& field, const glm::dvec3& p) const {
  std::array<std::uint32_t, 8> probe;
  std::array<float, 8> weight;
  const int used = weights(p, probe, weight);
  if (used == 0)
    return std::nullopt;
  return mean_of(field.probe, probe, weight, used);
}

std::optional<ShRadiance> LightFieldSampler::sample_all(const LightField& field, const glm::dvec3& p) const {
  std::array<std::uint32_t, 8> probe;
  std::array<float, 8> weight;
  const int used = weights(p, probe, weight);
  if (used == 0)
    return std::nullopt;
  ShRadiance radiance{mean_of(field.probe, probe, weight, used)};
  if (!field.band4.empty())
    radiance.band4 = mean_of(field.band4, probe, weight, used);
  return radiance;
}

} // namespace daylit
