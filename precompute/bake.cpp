#include "precompute/bake.h"

#include <algorithm>
#include <chrono>

#include "precompute/probes.h"
#include "radiosity/gather.h"

namespace daylit::precompute {

namespace {

class StageClock {
public:
  explicit StageClock(BakeReport& report) : report_(report), start_(now()), last_(start_) {}
  void finish(const char* name) {
    const auto t = now();
    report_.stages.push_back({name, std::chrono::duration<double>(t - last_).count()});
    last_ = t;
    report_.total_seconds = std::chrono::duration<double>(t - start_).count();
  }

private:
  static std::chrono::steady_clock::time_point now() { return std::chrono::steady_clock::now(); }
  BakeReport& report_;
  std::chrono::steady_clock::time_point start_, last_;
};

Result<ProbeSet> place_probes(const Room& room, const RayScene& scene, const std::vector<Aperture>& apertures,
                              const BakeOptions& options) {
  if (!options.points.empty())
    return make_points(options.points, room.bounds(), scene, apertures);
  Result<ProbeSet> grid = make_grid(room.bounds(), options.grid, options.spacing_m);
  if (grid)
    mark_air(*grid, scene, apertures);
  return grid;
}

/// [point][coefficient][channel * regions + region] -> [region][probe][coefficient][channel]
void store_basis(const std::vector<float>& coefficients, const std::vector<std::size_t>& probe_of_point,
                 std::size_t regions, BasisVolume& volume) {
  volume.basis.assign(regions * volume.row_floats(), 0.0f);
  for (std::size_t p = 0; p < probe_of_point.size(); ++p)
    for (std::size_t l = 0; l < 9; ++l)
      for (std::size_t c = 0; c < 3; ++c) {
        const float* from = coefficients.data() + ((p * 9 + l) * 3 + c) * regions;
        float* to = volume.basis.data() + probe_of_point[p] * 27 + l * 3 + c;
        for (std::size_t r = 0; r < regions; ++r)
          to[r * volume.row_floats()] = from[r];
      }
}

/// The transport problem of a room: mesh, unknowns and the two ray scenes.
struct Problem {
  RayScene room_scene, patch_rays;
  Apertures apertures;
  radiosity::PatchMesh mesh;
  radiosity::ElementSet elements;
};

Result<Problem> set_up(const Room& room, const BakeOptions& options) {
  Problem p;
  Result<RayScene> room_scene = RayScene::build(room);
  if (!room_scene)
    return room_scene.error();
  p.room_scene = *room_scene;
  Result<Apertures> apertures = find_apertures(room, p.room_scene);
  if (!apertures)
    return apertures.error();
  p.apertures = std::move(*apertures);
  Result<radiosity::PatchMesh> mesh =
      radiosity::mesh_patches(room, {.edge_m = options.patch_edge_m, .target_patches = options.target_patches});
  if (!mesh)
    return mesh.error();
  p.mesh = std::move(*mesh);
  Result<RayScene> patch_rays = radiosity::patch_scene(p.mesh);
  if (!patch_rays)
    return patch_rays.error();
  p.patch_rays = *patch_rays;
  p.elements = radiosity::find_elements(room, p.mesh, p.patch_rays, p.apertures.list);
  return p;
}

Result<std::vector<float>> gather_valid(const ProbeSet& probes, const Problem& problem,
                                        const radiosity::Radiosity& light, const BakeOptions& options,
                                        const Progress& progress, std::vector<std::size_t>& probe_of_point) {
  std::vector<glm::dvec3> points;
  for (std::size_t i = 0; i < probes.size(); ++i)
    if (probes.valid[i]) {
      probe_of_point.push_back(i);
      points.push_back(probes.origin + glm::dvec3(probes.positions[i]) - problem.mesh.origin);
    }
  return radiosity::gather_coefficients(points, problem.elements, problem.mesh, problem.patch_rays, light,
                                        {.rays = options.gather_rays}, progress);
}

} // namespace

Result<BakeOptions> quality_options(const std::string& name) {
  BakeOptions o;
  if (name == "normal")
    return o;
  if (name == "draft") {
    o.target_patches = 700;
    o.gather_rays = 512;
    o.visibility_rays = 16384;
    o.spacing_m = 0.5;
    return o;
  }
  if (name == "high") {
    o.target_patches = 6000;
    o.gather_rays = 4096;
    o.spacing_m = 0.2;
    return o;
  }
  return Error{ErrorCode::usage, "unknown quality '" + name + "'", "--quality", "use draft, normal or high"};
}

Result<BasisVolume> bake(const RoomFile& file, const SkyPartition& partition, const BakeOptions& options,
                         const Progress& progress, BakeReport& report) {
  StageClock clock(report);
  report.room = file.report;
  Result<Problem> problem = set_up(file.room, options);
  if (!problem)
    return problem.error();
  const radiosity::ElementSet& elements = problem->elements;
  report.apertures = problem->apertures.report;
  report.patches = problem->mesh.patches.size();
  report.patch_edge_m = problem->mesh.edge_m;
  report.elements = elements.elements.size();
  report.sides_skipped = elements.sides_skipped;
  clock.finish("mesh");

  Result<ProbeSet> probes = place_probes(file.room, problem->room_scene, problem->apertures.list, options);
  if (!probes)
    return probes.error();
  report.probes = probes->size();
  report.probes_valid = static_cast<std::size_t>(std::ranges::count(probes->valid, 1));
  clock.finish("probes");

  const auto light = radiosity::first_bounce(elements, problem->mesh, problem->patch_rays, problem->apertures.list,
                                             partition, progress, &report.first_bounce);
  if (!light)
    return light.error();
  report.regions = partition.size();
  report.regions_stored = static_cast<int>(light->columns());
  clock.finish("first bounce");

  const auto exchange = radiosity::exchange_areas(elements, problem->mesh, file.room, problem->room_scene,
                                                  {.visibility_rays = options.visibility_rays}, progress,
                                                  &report.exchange);
  if (!exchange)
    return exchange.error();
  clock.finish("form factors");

  const auto radiosity = radiosity::solve_radiosity(elements, *exchange, *light, {.tolerance = options.tolerance},
                                                    progress, &report.solve);
  if (!radiosity)
    return radiosity.error();
  report.energy = radiosity::audit_energy(elements, *exchange, *light, *radiosity);
  clock.finish("solve");

  std::vector<std::size_t> probe_of_point;
  const auto coefficients = gather_valid(*probes, *problem, *radiosity, options, progress, probe_of_point);
  if (!coefficients)
    return coefficients.error();
  BasisVolume volume{.partition = partition,
                     .probes = std::move(*probes),
                     .stored_region = light->region,
                     .basis = {},
                     .compact = {},
                     .room = file.room,
                     .apertures = problem->apertures.list,
                     .provenance = {}};
  clock.finish("volume");
  if (!partition.interpolated()) {
    store_basis(*coefficients, probe_of_point, light->columns(), volume);
    return volume;
  }
  auto compact = compact_sky(*coefficients, volume.probes, probe_of_point, partition, light->region,
                             {.error = options.compact_error}, progress, &report.compact);
  if (!compact)
    return compact.error();
  volume.compact = std::make_shared<const CompactBasis>(std::move(*compact));
  volume.stored_region.clear();
  clock.finish("fine sky");
  return volume;
}

} // namespace daylit::precompute
