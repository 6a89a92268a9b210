#include "precompute/detail/transport_problem.h"

#include <algorithm>
#include <array>
#include <map>
#include <span>

#include "precompute/far_probes.h"
#include "precompute/probes.h"
#include "precompute/small_holes.h"

namespace daylit::precompute::detail {

namespace {

/// A box need not hold an opening from which the air could be followed: its probes are given points.
Result<void> mark_valid(const Room& room, const RayScene& scene, const std::vector<Aperture>& apertures,
                        const BakeOptions& options, ProbeSet& grid) {
  if (options.box.empty()) {
    mark_air(grid, scene, apertures);
    return {};
  }
  std::vector<glm::dvec3> positions;
  for (const glm::vec3& p : grid.positions)
    positions.push_back(grid.origin + glm::dvec3(p));
  const Result<ProbeSet> points = make_points(positions, room.bounds(), scene, apertures);
  if (!points)
    return points.error();
  grid.valid = points->valid;
  return {};
}

/// Given points, or a grid of which the probes in the air are valid.
Result<ProbeSet> place_probes(const Room& room, const RayScene& scene, const std::vector<Aperture>& apertures,
                              const BakeOptions& options) {
  if (!options.points.empty()) {
    Result<ProbeSet> points = make_points(options.points, room.bounds(), scene, apertures);
    if (points && std::ranges::count(points->valid, 1) == 0)
      return Error{
          ErrorCode::value_invalid, "none of the points can be reached from an opening", "--points",
          "give points in the air of the room, x y z in metres: these are inside a wall or furniture, outdoors, "
          "or in a closed room"};
    return points;
  }
  const Bounds bounds = options.box.empty() ? room.bounds() : options.box;
  Result<ProbeSet> grid = make_grid(bounds, options.grid, options.spacing_m, options.density, options.near_surfaces);
  if (!grid)
    return grid;
  if (const Result<void> marked = mark_valid(room, scene, apertures, options, *grid); !marked)
    return marked.error();
  if (std::ranges::any_of(options.near_surfaces, [](const auto& along) { return !along.empty(); }))
    interpolate_far_probes(grid_planes(bounds, options.grid, options.spacing_m, options.density, options.near_surfaces),
                           scene, apertures, *grid);
  if (std::ranges::count(grid->valid, 1) == 0)
    return Error{
        ErrorCode::geometry_invalid, "no point of the room's inside can be reached from an opening", "room",
        "check that the walls enclose a space and that the windows lie in them; a coarse --grid or --spacing can "
        "miss a small room"};
  return grid;
}

/// W at the middle of a facet.
double importance(const radiosity::SurfaceMesh& mesh, const std::array<glm::dvec3, 3>& corner,
                  const radiosity::SizeField& field) {
  return field.importance(mesh.origin + (corner[0] + corner[1] + corner[2]) / 3.0);
}

/// sum W A^2 / sum W A
double mean_facet_m2(const radiosity::SurfaceMesh& mesh, const radiosity::SizeField& field) {
  double sum = 0, area = 0;
  for (const radiosity::Facet& f : mesh.facets) {
    const double weighted = f.area_m2 * std::min(importance(mesh, f.corner, field), 1.0);
    area += weighted;
    sum += weighted * f.area_m2;
  }
  return area > 0 ? sum / area : 0.0;
}

} // namespace

/// Scenes, openings, probes, mesh and patches, in the order in which each needs the one before.
Result<Problem> set_up(const Room& room, const BakeOptions& options, BakeReport& report, StageClock& clock) {
  Problem p;
  Result<RayScene> room_scene = RayScene::build(room);
  if (!room_scene)
    return room_scene.error();
  p.room_scene = *room_scene;
  Result<Apertures> apertures = find_apertures(room, p.room_scene);
  if (!apertures)
    return apertures.error();
  p.apertures = std::move(*apertures);
  Result<ProbeSet> probes = place_probes(room, p.room_scene, p.apertures.list, options);
  if (!probes)
    return probes.error();
  p.probes = std::move(*probes);
  clock.finish("probes");
  p.field = radiosity::SizeField(room, p.room_scene, options.receivers);
  p.holes = convex_outlines(small_holes(room, p.room_scene, p.apertures.list), room.bounds().centre());
  Result<radiosity::SurfaceMesh> mesh = radiosity::mesh_surfaces(room, {.edge_m = options.facet_edge_m,
                                                                        .target_facets = options.target_facets,
                                                                        .near_m = options.near_m,
                                                                        .field = p.field,
                                                                        .panes = p.apertures.list,
                                                                        .holes = p.holes});
  if (!mesh)
    return mesh.error();
  p.mesh = std::move(*mesh);
  Result<RayScene> facet_rays = radiosity::facet_scene(p.mesh);
  if (!facet_rays)
    return facet_rays.error();
  p.facet_rays = *facet_rays;
  // A grid has probes wherever light comes; given points may all stand in one of several rooms.
  const ProbePoints points(p.probes, p.mesh.origin);
  p.patches = radiosity::find_patches(room, p.mesh, p.facet_rays, p.apertures.list,
                                      options.points.empty() ? std::span<const glm::dvec3>{} : points.at);
  for (radiosity::Patch& e : p.patches.patches)
    e.importance = static_cast<float>(importance(p.mesh, e.corner, p.field));
  report.apertures = p.apertures.report;
  report.facets = p.mesh.facets.size();
  report.fixed_facets = p.mesh.fixed_facets;
  report.mean_facet_m2 = mean_facet_m2(p.mesh, p.field);
  report.facet_edge_m = p.mesh.edge_m;
  report.doubled_m2 = p.mesh.doubled_m2;
  report.patches = p.patches.patches.size();
  report.sides_skipped = p.patches.sides_skipped;
  report.sides_without_path = p.patches.sides_without_path;
  report.probes = p.probes.size();
  report.probes_valid = points.probe.size();
  report.probes_interpolated = static_cast<std::size_t>(std::ranges::count_if(p.probes.interpolated, std::identity{}));
  report.probes_repeated = points.probe.size() - points.at.size();
  clock.finish("mesh");
  return p;
}

/// Equal positions, as given points may have them, are gathered once.
ProbePoints::ProbePoints(const ProbeSet& probes, const glm::dvec3& mesh_origin) {
  std::map<std::array<float, 3>, std::size_t> known;
  for (std::size_t i = 0; i < probes.size(); ++i)
    if (probes.valid[i]) {
      const glm::vec3& p = probes.positions[i];
      const auto [found, added] = known.try_emplace({p.x, p.y, p.z}, at.size());
      if (added)
        at.push_back(probes.origin + glm::dvec3(p) - mesh_origin);
      probe.push_back(i);
      position.push_back(found->second);
    }
}

/// Row of each probe = row of its position.
std::vector<float> ProbePoints::spread(std::vector<float> rows) const {
  if (at.size() == probe.size())
    return rows;
  const std::size_t width = rows.size() / at.size();
  std::vector<float> all;
  for (const std::size_t p : position)
    all.insert(all.end(), rows.begin() + static_cast<std::ptrdiff_t>(p * width),
               rows.begin() + static_cast<std::ptrdiff_t>((p + 1) * width));
  return all;
}

} // namespace daylit::precompute::detail
