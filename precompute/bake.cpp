#include "precompute/bake.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <map>
#include <numeric>
#include <span>

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

/// The transport problem of a room: mesh, probes, unknowns and the two ray scenes.
struct Problem {
  RayScene room_scene, patch_rays;
  Apertures apertures;
  ProbeSet probes;
  radiosity::PatchMesh mesh;
  radiosity::ElementSet elements;
};

/// Positions of the valid probes, relative to the mesh origin, each place once, and which probes stand there.
struct ProbePoints {
  std::vector<glm::dvec3> at;
  std::vector<std::size_t> probe; ///< valid probes
  std::vector<std::size_t> place; ///< of each of these, in `at`

  ProbePoints(const ProbeSet& probes, const glm::dvec3& mesh_origin) {
    std::map<std::array<float, 3>, std::size_t> known;
    for (std::size_t i = 0; i < probes.size(); ++i)
      if (probes.valid[i]) {
        const glm::vec3& p = probes.positions[i];
        const auto [found, added] = known.try_emplace({p.x, p.y, p.z}, at.size());
        if (added)
          at.push_back(probes.origin + glm::dvec3(p) - mesh_origin);
        probe.push_back(i);
        place.push_back(found->second);
      }
  }

  /// Rows of places to rows of probes.
  std::vector<float> spread(std::vector<float> rows) const {
    if (at.size() == probe.size())
      return rows;
    const std::size_t width = rows.size() / at.size();
    std::vector<float> all;
    for (const std::size_t p : place)
      all.insert(all.end(), rows.begin() + static_cast<std::ptrdiff_t>(p * width),
                 rows.begin() + static_cast<std::ptrdiff_t>((p + 1) * width));
    return all;
  }
};

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
  Result<radiosity::PatchMesh> mesh =
      radiosity::mesh_patches(room, {.edge_m = options.patch_edge_m, .target_patches = options.target_patches});
  if (!mesh)
    return mesh.error();
  p.mesh = std::move(*mesh);
  Result<RayScene> patch_rays = radiosity::patch_scene(p.mesh);
  if (!patch_rays)
    return patch_rays.error();
  p.patch_rays = *patch_rays;
  // A grid has probes wherever light comes; given points may all stand in one of several rooms.
  const ProbePoints points(p.probes, p.mesh.origin);
  p.elements = radiosity::find_elements(room, p.mesh, p.patch_rays, p.apertures.list,
                                        options.points.empty() ? std::span<const glm::dvec3>{} : points.at);
  report.apertures = p.apertures.report;
  report.patches = p.mesh.patches.size();
  report.patch_edge_m = p.mesh.edge_m;
  report.elements = p.elements.elements.size();
  report.sides_skipped = p.elements.sides_skipped;
  report.sides_without_path = p.elements.sides_without_path;
  report.probes = p.probes.size();
  report.probes_valid = points.probe.size();
  report.probes_repeated = points.probe.size() - points.at.size();
  clock.finish("mesh");
  return p;
}

/// All regions of the sky at once, for the audit when no region is solved by itself.
radiosity::FirstBounce whole_sky(const radiosity::FirstBounce& light) {
  radiosity::FirstBounce one{.elements = light.elements,
                             .channels = light.channels,
                             .region = {0},
                             .irradiance = {},
                             .opening = light.opening};
  for (std::size_t i = 0; i < light.elements; ++i)
    for (int c = 0; c < light.channels; ++c)
      one.irradiance.push_back(
          static_cast<float>(std::accumulate(light.row(i, c), light.row(i, c) + light.columns(), 0.0)));
  return one;
}

/// The interior transport: from the first light to the coefficients at the points, by whichever side has fewer columns.
Result<std::vector<float>> transport(const Problem& problem, const radiosity::ExchangeMatrix& exchange,
                                     const radiosity::FirstBounce& light, const ProbePoints& points,
                                     const BakeOptions& options, const Progress& progress, BakeReport& report,
                                     StageClock& clock) {
  const radiosity::SolveOptions solve{.tolerance = options.tolerance, .store = options.store};
  const radiosity::GatherOptions gather{.rays = options.gather_rays};
  report.adjoint = 9 * points.at.size() < light.columns();
  const radiosity::FirstBounce driving = report.adjoint ? whole_sky(light) : radiosity::FirstBounce{};
  const radiosity::FirstBounce& forward = report.adjoint ? driving : light;
  const auto radiosity =
      radiosity::solve_radiosity(problem.elements, exchange, forward, solve, progress, &report.solve);
  if (!radiosity)
    return radiosity.error();
  report.energy = radiosity::audit_energy(problem.elements, exchange, forward, *radiosity);
  clock.finish("solve");
  auto coefficients =
      report.adjoint ? radiosity::adjoint_coefficients(points.at, problem.elements, problem.mesh, problem.patch_rays,
                                                       exchange, light, solve, gather, progress, &report.solve)
                     : radiosity::gather_coefficients(points.at, problem.elements, problem.mesh, problem.patch_rays,
                                                      *radiosity, gather, progress);
  clock.finish("volume");
  return coefficients;
}

} // namespace

Result<BakeOptions> quality_options(const std::string& name, bool given_points) {
  BakeOptions o;
  if (name == "draft") {
    o.target_patches = 700;
    o.gather_rays = 512;
    o.visibility_rays = 16384;
    o.spacing_m = 0.5;
  } else if (name == "high") {
    o.target_patches = 6000;
    o.visibility_rays = 524288;
    o.gather_rays = 8192;
    o.spacing_m = 0.2;
  } else if (name != "normal") {
    return Error{ErrorCode::usage, "unknown quality '" + name + "'", "--quality", "use draft, normal or high"};
  }
  if (given_points) {
    o.target_patches = o.target_patches * 8 / 5;
    o.gather_rays *= 2;
  }
  return o;
}

Result<BasisVolume> bake(const RoomFile& file, const SkyPartition& partition, const BakeOptions& options,
                         const Progress& progress, BakeReport& report) {
  StageClock clock(report);
  report.room = file.report;
  Result<Problem> problem = set_up(file.room, options, report, clock);
  if (!problem)
    return problem.error();
  const radiosity::ElementSet& elements = problem->elements;

  const auto light = radiosity::first_bounce(elements, problem->mesh, problem->patch_rays, problem->apertures.list,
                                             partition, progress, &report.first_bounce);
  if (!light)
    return light.error();
  report.regions = partition.size();
  report.regions_stored = static_cast<int>(light->columns());
  clock.finish("first bounce");

  const auto exchange = radiosity::exchange_areas(elements, problem->mesh, file.room, problem->room_scene,
                                                  {.visibility_rays = options.visibility_rays,
                                                   .low_rank_tolerance = options.low_rank_tolerance,
                                                   .skip_black = true,
                                                   .store = options.store},
                                                  progress, &report.exchange);
  if (!exchange)
    return exchange.error();
  clock.finish("form factors");

  const ProbePoints points(problem->probes, problem->mesh.origin);
  auto places = transport(*problem, *exchange, *light, points, options, progress, report, clock);
  if (!places)
    return places.error();
  const std::vector<float> coefficients = points.spread(std::move(*places));
  BasisVolume volume{.partition = partition,
                     .probes = std::move(problem->probes),
                     .stored_region = light->region,
                     .basis = {},
                     .compact = {},
                     .room = file.room,
                     .apertures = problem->apertures.list,
                     .provenance = {}};
  if (!partition.interpolated()) {
    store_basis(coefficients, points.probe, light->columns(), volume);
    return volume;
  }
  auto compact = compact_sky(coefficients, volume.probes, points.probe, partition, light->region,
                             {.error = options.compact_error}, progress, &report.compact);
  if (!compact)
    return compact.error();
  volume.compact = std::make_shared<const CompactBasis>(std::move(*compact));
  volume.stored_region.clear();
  clock.finish("fine sky");
  return volume;
}

} // namespace daylit::precompute
