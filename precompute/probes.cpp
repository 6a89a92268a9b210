#include "precompute/probes.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "scene/core/read_file.h"
#include "scene/volume/probe_planes.h"

namespace daylit::precompute {

namespace {

// The outer probes: close enough to the walls that little is extrapolated, far enough to stand in the air.
constexpr double kWallMargin = 0.04; // metres, at most a tenth of the spacing
constexpr double kBehind = 1e-3;     // of the way to a probe
constexpr std::size_t kMaxProbes = 4'000'000;
constexpr std::size_t kMaxPointsFile_bytes = std::size_t{1} << 30;
constexpr double kAuxiliarySpacing = 0.3; // metres, of the grid that decides about free points

glm::dvec3 world(const ProbeSet& probes, std::size_t i) { return probes.origin + glm::dvec3(probes.positions[i]); }

/// Points a hand's breadth inside every aperture.
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

/// Planes of one axis relative to the centre of the room: from margin to margin, and from the lowest to the highest of
/// those that are given.
std::vector<double> axis_planes(const Bounds& room, int axis, int count, double spacing_m, const ProbeDensity& density,
                                const Planes& near_surfaces) {
  const double size = room.size()[axis], high = 0.5 * size - wall_margin(size, spacing_m), centre = room.centre()[axis];
  std::vector<double> fixed;
  for (const double x : near_surfaces[static_cast<std::size_t>(axis)])
    if (std::abs(x - centre) < 0.5 * size)
      fixed.push_back(x - centre);
  const double first = fixed.empty() ? -high : std::min(-high, fixed.front()),
               last = fixed.empty() ? high : std::max(high, fixed.back());
  std::erase_if(fixed, [&](double x) { return x <= first || x >= last; });
  return planes_of(density[static_cast<std::size_t>(axis)], count, first, last, fixed);
}

} // namespace

glm::ivec3 grid_size(const Bounds& room, double spacing_m, const ProbeDensity& density, const Planes& near_surfaces) {
  glm::ivec3 count = grid_size(room, spacing_m);
  for (int k = 0; k < 3; ++k)
    if (!near_surfaces[static_cast<std::size_t>(k)].empty())
      count[k] = static_cast<int>(axis_planes(room, k, count[k], spacing_m, density, near_surfaces).size());
  return count;
}

/// Position of probe (x, y, z): -span / 2 + i span / (count - 1) per axis from the centre of the room, or the planes of
/// the density and those near surfaces.
Result<ProbeSet> make_grid(const Bounds& room, const glm::ivec3& count, double spacing_m, const ProbeDensity& density,
                           const Planes& near_surfaces) {
  const glm::dvec3 size = room.size();
  ProbeSet grid;
  grid.is_grid = true;
  grid.origin = room.centre();
  const bool graded =
      is_graded(density) || std::ranges::any_of(near_surfaces, [](const auto& along) { return !along.empty(); });
  std::array<std::vector<double>, 3> planes;
  double total = 1;
  for (int k = 0; k < 3; ++k) {
    const double span = size[k] - 2.0 * wall_margin(size[k], spacing_m);
    grid.count[k] = count[k] > 0 ? count[k] : axis_count(span, spacing_m);
    total *= grid.count[k];
    if (!(total <= static_cast<double>(kMaxProbes)))
      return Error{ErrorCode::limit_exceeded, "the grid would have more than 4 million probes", "probe grid",
                   "use a larger --spacing; is the room really in metres?"};
    auto& along = planes[static_cast<std::size_t>(k)];
    grid.spacing[k] = grid.count[k] > 1 ? span / (grid.count[k] - 1) : span;
    for (int i = 0; !graded && i < grid.count[k]; ++i)
      along.push_back(-0.5 * span + i * grid.spacing[k]);
    if (graded) {
      along = axis_planes(room, k, grid.count[k], spacing_m, density, near_surfaces);
      grid.count[k] = static_cast<int>(along.size());
      grid.spacing[k] = (along.back() - along.front()) / (grid.count[k] - 1);
    }
  }
  for (const double z : planes[2])
    for (const double y : planes[1])
      for (const double x : planes[0])
        grid.positions.emplace_back(x, y, z);
  if (graded)
    grid.planes = std::move(planes);
  grid.valid.assign(grid.positions.size(), 0);
  return grid;
}

/// Flood fill from the apertures: a probe is in the air when an open segment joins it to a seed or to a neighbour that
/// is.
void mark_air(ProbeSet& grid, const RayScene& scene, const std::vector<Aperture>& apertures) {
  const GridIndex cells(grid);
  std::vector<std::size_t> queue;
  // A way that ends a little behind the probe: one that stands in the plane of a wall would lead through the wall.
  const auto try_from = [&](std::size_t i, const glm::dvec3& from) {
    const glm::dvec3 to = world(grid, i);
    if (grid.valid[i] || !open_between(from, to + kBehind * (to - from), scene, apertures))
      return;
    grid.valid[i] = 1;
    queue.push_back(i);
  };
  const double step_m = std::min({grid.spacing.x, grid.spacing.y, grid.spacing.z});
  for (const glm::dvec3& seed : air_seeds(apertures, step_m))
    cells.near(seed, 2, [&](std::size_t i) { try_from(i, seed); });
  while (!queue.empty()) {
    const std::size_t i = queue.back();
    queue.pop_back();
    const glm::ivec3 c = cells.cell(i);
    for (int n = 0; n < 27; ++n) {
      const glm::ivec3 next = c + glm::ivec3(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
      if (cells.contains(next))
        try_from(cells.index(next), world(grid, i));
    }
  }
}

/// A given point is in the air when an open segment joins it to a probe in the air of an auxiliary grid.
Result<ProbeSet> make_points(const std::vector<glm::dvec3>& world_points, const Bounds& room, const RayScene& scene,
                             const std::vector<Aperture>& apertures) {
  const glm::dvec3 size = room.size();
  Result<ProbeSet> grid =
      make_grid(room, glm::ivec3(0), std::max(kAuxiliarySpacing, std::max({size.x, size.y, size.z}) / 150));
  if (!grid)
    return grid.error();
  mark_air(*grid, scene, apertures);
  const GridIndex cells(*grid);
  ProbeSet points;
  points.origin = room.centre();
  for (const glm::dvec3& p : world_points) {
    bool in_air = false;
    for (int ring = 1; ring <= 3 && !in_air; ++ring)
      cells.near(p, ring, [&](std::size_t i) {
        in_air = in_air || (grid->valid[i] && open_between(p, world(*grid, i), scene, apertures));
      });
    points.positions.emplace_back(p - points.origin);
    points.valid.push_back(in_air ? 1 : 0);
  }
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
