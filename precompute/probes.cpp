#include "precompute/probes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "radiosity/detail/sampling.h"
#include "scene/core/parallel.h"
#include "scene/core/read_file.h"
#include "scene/volume/probe_planes.h"

namespace daylit::precompute {

namespace {

// The outer probes: close enough to the walls that little is extrapolated, far enough to stand in the air.
constexpr double kWallMargin = 0.04; // metres, at most a tenth of the spacing
constexpr double kSamePlane = 0.5;   // of the outermost probes' distance from a wall: a plane so near them is theirs
constexpr double kMoved = 0.3;       // of a step: so far may a plane be moved
constexpr double kCommon = 0.5;      // of the room's section: a plane that is wanted there is wanted everywhere
constexpr double kBehind = 1e-3;     // of the way to a probe
constexpr std::size_t kWays = 64, kMostWays = 131072; // of light, on the search for air behind small holes
constexpr std::uint64_t kWalkBounces = 6;
constexpr double kOffSurface = 0.9; // of the way to a surface
constexpr float kWayClear = 0.05f;  // of the smallest spacing: nearer to surfaces a way would end
constexpr std::size_t kMaxProbes = 4'000'000;
constexpr std::size_t kMaxPointsFile_bytes = std::size_t{1} << 30;
// Of the grid that decides about free points: units, and parts of its longest side.
constexpr double kAuxiliarySpacing = 0.3, kAuxiliaryLargest = 0.3 / 8, kAuxiliarySmallest = 1.0 / 150;
constexpr double kDetour = 0.5; // of the longest side: so far may a way lead around points and openings

glm::dvec3 world(const ProbeSet& probes, std::size_t i) { return probes.origin + glm::dvec3(probes.positions[i]); }

} // namespace

std::vector<glm::dvec3> air_seeds(const std::vector<Aperture>& apertures, double step_m) {
  std::vector<glm::dvec3> seeds;
  for (const Aperture& a : apertures) {
    glm::dvec3 middle(0.0);
    for (const glm::dvec3& c : a.corners)
      middle += c / static_cast<double>(a.corners.size());
    for (const double in : {0.05, 0.3, 1.0})
      seeds.push_back(middle + in * step_m * a.inward);
    for (const glm::dvec3& c : a.corners)
      seeds.push_back(glm::mix(middle, c, 0.6) + 0.3 * step_m * a.inward);
  }
  return seeds;
}

namespace {

class GridIndex {
public:
  explicit GridIndex(const ProbeSet& grid) : grid_(grid), planes_(grid) {}
  std::size_t index(const glm::ivec3& c) const {
    return (static_cast<std::size_t>(c.z) * grid_.count.y + c.y) * grid_.count.x + c.x;
  }
  glm::ivec3 cell(std::size_t i) const {
    const auto n = static_cast<int>(i);
    return {n % grid_.count.x, n / grid_.count.x % grid_.count.y, n / (grid_.count.x * grid_.count.y)};
  }
  bool contains(const glm::ivec3& c) const {
    return c.x >= 0 && c.y >= 0 && c.z >= 0 && c.x < grid_.count.x && c.y < grid_.count.y && c.z < grid_.count.z;
  }
  /// Calls visit(probe) for the probes within `ring` steps of a world point.
  template <class Visit>
  void near(const glm::dvec3& world_point, int ring, const Visit& visit) const {
    const glm::ivec3 base(planes_.below(0, world_point.x), planes_.below(1, world_point.y),
                          planes_.below(2, world_point.z));
    for (int z = base.z - ring + 1; z <= base.z + ring; ++z)
      for (int y = base.y - ring + 1; y <= base.y + ring; ++y)
        for (int x = base.x - ring + 1; x <= base.x + ring; ++x)
          if (contains({x, y, z}))
            visit(index({x, y, z}));
  }

private:
  const ProbeSet& grid_;
  ProbePlanes planes_;
};

/// Probes along an axis: the fewest whose distance is at most the spacing, 1 + ceil(length / spacing).
int axis_count(double length_m, double spacing_m) {
  return std::max(2, static_cast<int>(std::ceil(std::min(length_m / spacing_m, 1e6) - 1e-9)) + 1);
}

/// Distance of the outermost probes from the walls, metres.
double wall_margin(double size_m, double spacing_m) {
  return std::min(kWallMargin, 0.1 * std::min(spacing_m, 0.5 * size_m));
}

} // namespace

/// Neither a surface nor an opening lies between: visibility 1 inside the room.
bool open_between(const glm::dvec3& a, const glm::dvec3& b, const RayScene& scene,
                  const std::vector<Aperture>& apertures) {
  const glm::dvec3 d = b - a;
  const double distance = glm::length(d);
  if (distance <= 0.0)
    return true;
  const glm::dvec3 u = d / distance;
  int crossed = 0;
  if (scene.occluded(scene.to_local(a), glm::vec3(u), 0.0f, static_cast<float>(distance)))
    return false;
  (void)aperture_transmittance(apertures, a, u, distance, &crossed);
  return crossed == 0;
}

/// Probes per axis of a regular grid over the room less its margins.
glm::ivec3 grid_size(const Bounds& room, double spacing_m) {
  const glm::dvec3 size = room.size();
  glm::ivec3 count(0);
  for (int k = 0; k < 3; ++k)
    count[k] = axis_count(size[k] - 2.0 * wall_margin(size[k], spacing_m), spacing_m);
  return count;
}

namespace {

/// The planes of the density and those near surfaces. One of the former that has one of the latter close by is moved
/// onto it, but for the first and the last.
std::vector<ProbePlane> joined(const std::vector<double>& base, std::vector<ProbePlane> near) {
  for (std::size_t i = 0; i < base.size(); ++i) {
    const bool inner = i > 0 && i + 1 < base.size();
    const double step = inner ? std::min(base[i] - base[i - 1], base[i + 1] - base[i]) : 0.0;
    const auto distance = [&](const ProbePlane& p) { return std::abs(p.at - base[i]); };
    const auto nearest = std::ranges::min_element(near, {}, distance);
    if (nearest != near.end() && distance(*nearest) <= kMoved * step)
      nearest->where.clear();
    else
      near.push_back({base[i], {}});
  }
  std::ranges::sort(near, {}, &ProbePlane::at);
  return near;
}

/// Wanted in most of the room.
bool is_common(const ProbePlane& plane, const Bounds& room, int axis) {
  double area = 0, all = 1;
  for (int k = 0; k < 3; ++k)
    all *= k == axis ? 1.0 : room.size()[k];
  for (const Bounds& box : plane.where) {
    double own = 1;
    for (int k = 0; k < 3; ++k)
      own *= k == axis ? 1.0 : std::max(std::min(box.max[k], room.max[k]) - std::max(box.min[k], room.min[k]), 0.0);
    area += own;
  }
  return area >= kCommon * all;
}

} // namespace

/// From margin to margin, and from the lowest to the highest of those near surfaces.
Planes grid_planes(const Bounds& room, const glm::ivec3& count, double spacing_m, const ProbeDensity& density,
                   const Planes& near_surfaces) {
  Planes planes;
  for (int axis = 0; axis < 3; ++axis) {
    const auto k = static_cast<std::size_t>(axis);
    const double size = room.size()[axis], margin = wall_margin(size, spacing_m);
    std::vector<ProbePlane> near = near_surfaces[k], added;
    std::erase_if(near, [&](const ProbePlane& p) { return p.at <= room.min[axis] || p.at >= room.max[axis]; });
    const auto first_added = std::ranges::stable_partition(near, [](const ProbePlane& p) { return !p.added; }).begin();
    added.assign(first_added, near.end());
    near.erase(first_added, near.end());
    const double first = std::min(room.min[axis] + margin, near.empty() ? room.max[axis] : near.front().at),
                 last = std::max(room.max[axis] - margin, near.empty() ? room.min[axis] : near.back().at);
    const auto is_end = [&](const ProbePlane& p) { return std::min(p.at - first, last - p.at) < kSamePlane * margin; };
    std::erase_if(near, is_end);
    std::vector<double> common;
    for (const ProbePlane& p : near)
      if (is_common(p, room, axis))
        common.push_back(p.at);
    std::erase_if(near, [&](const ProbePlane& p) { return std::ranges::binary_search(common, p.at); });
    const int wanted = count[axis] > 0 ? count[axis] : axis_count(size - 2.0 * margin, spacing_m);
    planes[k] = joined(planes_of(density[k], wanted, first, last, common), std::move(near));
    std::ranges::copy_if(added, std::back_inserter(planes[k]),
                         [&](const ProbePlane& p) { return p.at > first && p.at < last; });
    std::ranges::sort(planes[k], {}, &ProbePlane::at);
  }
  return planes;
}

glm::ivec3 grid_size(const Bounds& room, double spacing_m, const ProbeDensity& density, const Planes& near_surfaces) {
  const Planes planes = grid_planes(room, glm::ivec3(0), spacing_m, density, near_surfaces);
  return {static_cast<int>(planes[0].size()), static_cast<int>(planes[1].size()), static_cast<int>(planes[2].size())};
}

Result<void> check_probe_count(const glm::ivec3& count) {
  if (static_cast<double>(count.x) * count.y * count.z <= static_cast<double>(kMaxProbes))
    return {};
  return Error{ErrorCode::limit_exceeded, "the grid would have more than 4 million probes", "probe grid",
               "use a larger --spacing; is the room really in metres?"};
}

namespace {

/// The coordinates of a graded grid, relative to its origin.
void take_planes(const Planes& planes, ProbeSet& grid) {
  for (int k = 0; k < 3; ++k) {
    std::vector<double>& along = grid.planes[static_cast<std::size_t>(k)];
    for (const ProbePlane& p : planes[static_cast<std::size_t>(k)])
      along.push_back(p.at - grid.origin[k]);
    grid.count[k] = static_cast<int>(along.size());
    grid.spacing[k] = (along.back() - along.front()) / (grid.count[k] - 1);
  }
}

} // namespace

/// Position of probe (x, y, z): -span / 2 + i span / (count - 1) per axis from the centre of the room, or the planes of
/// the density and those near surfaces.
Result<ProbeSet> make_grid(const Bounds& room, const glm::ivec3& count, double spacing_m, const ProbeDensity& density,
                           const Planes& near_surfaces) {
  ProbeSet grid;
  grid.is_grid = true;
  grid.origin = room.centre();
  glm::dvec3 span(0.0);
  for (int k = 0; k < 3; ++k) {
    span[k] = room.size()[k] - 2.0 * wall_margin(room.size()[k], spacing_m);
    grid.count[k] = count[k] > 0 ? count[k] : axis_count(span[k], spacing_m);
    grid.spacing[k] = grid.count[k] > 1 ? span[k] / (grid.count[k] - 1) : span[k];
  }
  if (const Result<void> good = check_probe_count(grid.count); !good)
    return good.error();
  if (is_graded(density) || std::ranges::any_of(near_surfaces, [](const auto& along) { return !along.empty(); }))
    take_planes(grid_planes(room, count, spacing_m, density, near_surfaces), grid);
  if (const Result<void> good = check_probe_count(grid.count); !good)
    return good.error();
  const auto at = [&](int axis, int i) {
    return grid.is_graded() ? grid.planes[static_cast<std::size_t>(axis)][static_cast<std::size_t>(i)]
                            : -0.5 * span[axis] + i * grid.spacing[axis];
  };
  for (int z = 0; z < grid.count.z; ++z)
    for (int y = 0; y < grid.count.y; ++y)
      for (int x = 0; x < grid.count.x; ++x)
        grid.positions.emplace_back(at(0, x), at(1, y), at(2, z));
  grid.valid.assign(grid.positions.size(), 0);
  return grid;
}

namespace {

/// Flood fill: a probe is in the air when an open segment joins it to a seed or to a neighbour that is.
class AirFill {
public:
  AirFill(ProbeSet& grid, const RayScene& scene, const std::vector<Aperture>& apertures)
      : grid_(grid), cells_(grid), scene_(scene), apertures_(apertures) {}

  /// From the probes within `ring` steps of a point in the air.
  void from(const glm::dvec3& seed, int ring) {
    cells_.near(seed, ring, [&](std::size_t i) { try_from(i, seed); });
    spread();
  }

private:
  // A way that ends a little behind the probe: one that stands in the plane of a wall would lead through the wall.
  void try_from(std::size_t i, const glm::dvec3& from) {
    const glm::dvec3 to = world(grid_, i);
    if (grid_.valid[i] || !open_between(from, to + kBehind * (to - from), scene_, apertures_))
      return;
    grid_.valid[i] = 1;
    queue_.push_back(i);
  }

  void spread() {
    while (!queue_.empty()) {
      const std::size_t i = queue_.back();
      queue_.pop_back();
      const glm::ivec3 c = cells_.cell(i);
      for (int n = 0; n < 27; ++n) {
        const glm::ivec3 next = c + glm::ivec3(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
        if (cells_.contains(next))
          try_from(cells_.index(next), world(grid_, i));
      }
    }
  }

  ProbeSet& grid_;
  GridIndex cells_;
  const RayScene& scene_;
  const std::vector<Aperture>& apertures_;
  std::vector<std::size_t> queue_;
};

/// A way through the air, uniform over directions at each turn: the points at which it turns, before surfaces.
std::vector<glm::dvec3> way_of_light(glm::dvec3 p, std::uint32_t index, float clear, const RayScene& scene,
                                     const std::vector<Aperture>& apertures) {
  std::vector<glm::dvec3> way;
  for (std::uint64_t bounce = 0; bounce < kWalkBounces; ++bounce) {
    const glm::dvec3 d =
        radiosity::sphere_direction(r2_point(index, radiosity::random_shift(radiosity::mix_bits(index) + bounce)));
    RayHit hit;
    if (!scene.closest(scene.to_local(p), glm::vec3(d), 0.0f, std::numeric_limits<float>::infinity(), hit))
      break;
    const glm::dvec3 landed = p + kOffSurface * static_cast<double>(hit.distance) * d;
    // From close to a surface a probe in its plane would be reached, and from there what is behind it.
    if (scene.distance(scene.to_local(landed), clear) < clear || !open_between(p, landed, scene, apertures))
      break;
    p = landed;
    way.push_back(p);
  }
  return way;
}

} // namespace

/// From the apertures, and then along random ways: these also pass holes that no segment between neighbouring
/// probes happens to pass.
void mark_air(ProbeSet& grid, const RayScene& scene, const std::vector<Aperture>& apertures) {
  AirFill air(grid, scene, apertures);
  const double step_m = std::min({grid.spacing.x, grid.spacing.y, grid.spacing.z});
  for (const glm::dvec3& seed : air_seeds(apertures, step_m))
    air.from(seed, 2);
  std::vector<std::size_t> reached;
  for (std::size_t i = 0; i < grid.size(); ++i)
    if (grid.valid[i])
      reached.push_back(i);
  if (reached.empty() || reached.size() == grid.size())
    return;
  const std::size_t count = std::min(kWays * (grid.size() - reached.size()), kMostWays);
  std::vector<std::vector<glm::dvec3>> ways(count);
  parallel_for(std::size_t{0}, count, [&](std::size_t k) {
    ways[k] = way_of_light(world(grid, reached[k * reached.size() / count]), static_cast<std::uint32_t>(k),
                           kWayClear * static_cast<float>(step_m), scene, apertures);
  });
  for (const std::vector<glm::dvec3>& way : ways)
    for (const glm::dvec3& p : way)
      air.from(p, 1);
}

namespace {

/// Where a way through the air from an opening to a point may lead: not over all the ground outside.
Bounds way_bounds(const std::vector<glm::dvec3>& points, const Bounds& room, const std::vector<Aperture>& apertures) {
  if (apertures.empty())
    return room;
  Bounds box;
  for (const glm::dvec3& p : points)
    box.include(p);
  for (const Aperture& a : apertures)
    for (const glm::dvec3& c : a.corners)
      box.include(c);
  const glm::dvec3 size = box.size(), more(kDetour * std::max({size.x, size.y, size.z}));
  return {glm::max(box.min - more, room.min), glm::min(box.max + more, room.max)};
}

} // namespace

/// A given point is in the air when an open segment joins it to a probe in the air of an auxiliary grid.
Result<ProbeSet> make_points(const std::vector<glm::dvec3>& world_points, const Bounds& room, const RayScene& scene,
                             const std::vector<Aperture>& apertures) {
  const Bounds box = way_bounds(world_points, room, apertures);
  const glm::dvec3 size = box.size();
  const double longest = std::max({size.x, size.y, size.z});
  Result<ProbeSet> grid = make_grid(
      box, glm::ivec3(0), std::clamp(kAuxiliarySpacing, kAuxiliarySmallest * longest, kAuxiliaryLargest * longest));
  if (!grid)
    return grid.error();
  mark_air(*grid, scene, apertures);
  const GridIndex cells(*grid);
  ProbeSet points;
  points.origin = room.centre();
  for (const glm::dvec3& p : world_points)
    points.positions.emplace_back(p - points.origin);
  points.valid.assign(world_points.size(), 0);
  parallel_for(std::size_t{0}, world_points.size(), [&](std::size_t k) {
    const glm::dvec3& p = world_points[k];
    for (int ring = 1; ring <= 3 && !points.valid[k]; ++ring)
      cells.near(p, ring, [&](std::size_t i) {
        if (!points.valid[k] && grid->valid[i] && open_between(p, world(*grid, i), scene, apertures))
          points.valid[k] = 1;
      });
  });
  return points;
}

Result<std::vector<glm::dvec3>> read_points(const std::filesystem::path& path) {
  const auto bytes = read_whole_file(path, kMaxPointsFile_bytes);
  if (!bytes)
    return bytes.error();
  std::istringstream file(std::string(bytes->begin(), bytes->end()));
  std::vector<glm::dvec3> points;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    line.resize(std::min(line.find('#'), line.size()));
    if (line.find_first_not_of(" \t\r") == std::string::npos)
      continue;
    std::istringstream words(line);
    glm::dvec3 p;
    std::string rest;
    if (!(words >> p.x >> p.y >> p.z) || (words >> rest) || !std::isfinite(p.x + p.y + p.z))
      return Error{ErrorCode::file_malformed, "expected three numbers x y z in metres",
                   path.string() + ", line " + std::to_string(number), ""};
    points.push_back(p);
  }
  if (points.empty())
    return Error{ErrorCode::file_malformed, "the list of points is empty", path.string(), "one x y z per line"};
  return points;
}

} // namespace daylit::precompute
