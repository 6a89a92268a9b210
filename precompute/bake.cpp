#include "precompute/bake.h"

#include <algorithm>
#include <chrono>
#include <numeric>
#include <optional>
#include <span>

#include "precompute/detail/node_sharpening.h"
#include "precompute/probe_fit.h"
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

/// Positions of the valid probes, relative to the mesh origin, and which probe each is.
struct ProbePoints {
  std::vector<glm::dvec3> at;
  std::vector<std::size_t> probe;

  ProbePoints(const ProbeSet& probes, const glm::dvec3& mesh_origin) {
    for (std::size_t i = 0; i < probes.size(); ++i)
      if (probes.valid[i]) {
        probe.push_back(i);
        at.push_back(probes.origin + glm::dvec3(probes.positions[i]) - mesh_origin);
      }
  }
};

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

/// Coefficients at the probes for the sky's regions and for the held-out skies, and at the held-out points:
/// [point][lm][channel * columns + column].
struct Transported {
  std::vector<float> regions, skies_at_probes, skies_at_points;
};

constexpr int kHeldOutRays = 4; ///< times those of a probe

/// The interior transport: from the first light to the coefficients at the points, by whichever side has fewer
/// columns.
class Transport {
public:
  Transport(const Problem& problem, const radiosity::ExchangeMatrix& exchange, const BakeOptions& options,
            const Progress& progress, BakeReport& report, StageClock& clock)
      : problem_(problem), exchange_(exchange), progress_(progress), report_(report),
        clock_(clock), solve_{.tolerance = options.tolerance, .store = options.store}, gather_{
                                                                                           .rays =
                                                                                               options.gather_rays} {}

  /// `skies`: the first light of held-out skies, no columns where none are asked for; `held_out`: points of the
  /// audit.
  /// `hits`: what the points see, where that is known.
  Result<Transported> run(const radiosity::FirstBounce& regions, const radiosity::FirstBounce& skies,
                          std::span<const glm::dvec3> points, const radiosity::GatherHits* hits,
                          std::span<const glm::dvec3> held_out) const {
    report_.adjoint = 9 * points.size() < regions.columns();
    const auto next = static_cast<std::int32_t>(report_.regions);
    const radiosity::FirstBounce light = joined(regions, skies, next);
    const radiosity::FirstBounce forward =
        report_.adjoint ? joined(whole_sky(regions), skies, next) : radiosity::FirstBounce{};
    const radiosity::FirstBounce& driving = report_.adjoint ? forward : light;
    const auto radiosity =
        radiosity::solve_radiosity(problem_.elements, exchange_, driving, solve_, progress_, &report_.solve);
    if (!radiosity)
      return radiosity.error();
    report_.energy = radiosity::audit_energy(problem_.elements, exchange_, driving, *radiosity);
    clock_.finish("solve");
    auto all =
        hits ? Result<std::vector<float>>(hits->coefficients(*radiosity)) : coefficients(light, *radiosity, points);
    if (!all)
      return all.error();
    Transported out{std::move(*all), {}, {}};
    clock_.finish("volume");
    if (skies.columns() == 0)
      return out;
    out.skies_at_probes = split_columns(out.regions, light.columns(), skies.columns());
    const auto direct =
        radiosity::gather_coefficients(held_out, problem_.elements, problem_.mesh, problem_.patch_rays,
                                       columns_of(*radiosity, driving.columns() - skies.columns(), skies.columns()),
                                       {.rays = kHeldOutRays * gather_.rays}, progress_);
    if (!direct)
      return direct.error();
    out.skies_at_points = *direct;
    return out;
  }

private:
  Result<std::vector<float>> coefficients(const radiosity::FirstBounce& light, const radiosity::Radiosity& radiosity,
                                          std::span<const glm::dvec3> points) const {
    return report_.adjoint
               ? radiosity::adjoint_coefficients(points, problem_.elements, problem_.mesh, problem_.patch_rays,
                                                 exchange_, light, solve_, gather_, progress_, &report_.solve)
               : radiosity::gather_coefficients(points, problem_.elements, problem_.mesh, problem_.patch_rays,
                                                radiosity, gather_, progress_);
  }

  const Problem& problem_;
  const radiosity::ExchangeMatrix& exchange_;
  const Progress& progress_;
  BakeReport& report_;
  StageClock& clock_;
  radiosity::SolveOptions solve_;
  radiosity::GatherOptions gather_;
};

/// The audit of these probes and the first light of its skies; neither where none is asked for.
struct HeldOutLight {
  std::optional<Audit> audit;
  radiosity::FirstBounce skies;
};

Result<HeldOutLight> held_out_light(const Problem& problem, const Room& room, const ProbeSet& probes,
                                    const BakeOptions& options, const Progress& progress) {
  HeldOutLight out;
  if (!options.audit)
    return out;
  Result<Audit> audit = Audit::prepare(room, problem.apertures.list, probes, options.held_out);
  if (!audit)
    return audit.error();
  const auto light = radiosity::first_bounce(problem.elements, problem.mesh, problem.patch_rays, problem.apertures.list,
                                             held_out_partition(), progress);
  if (!light)
    return light.error();
  out.skies = audit->first_light(*light, problem.elements);
  out.audit = std::move(*audit);
  return out;
}

/// Probe values for linear interpolation.
ProbeFit fit_to_interpolation(const Problem& problem, const ProbeSet& probes,
                              const std::vector<std::size_t>& probe_of_point) {
  return ProbeFit::make(probes, probe_of_point, [&](std::size_t a, std::size_t b) {
    const auto at = [&](std::size_t i) { return probes.origin + glm::dvec3(probes.positions[i]); };
    return open_between(at(a), at(b), problem.room_scene, problem.apertures.list);
  });
}

/// A first light of no regions on the same elements.
radiosity::FirstBounce without_columns(const radiosity::FirstBounce& light) {
  return {
      .elements = light.elements, .channels = light.channels, .region = {}, .irradiance = {}, .opening = light.opening};
}

/// A sky of nodes: the light on the surfaces node by node, then the factors from the surfaces to the probes.
Result<void> bake_fine_sky(const Problem& problem, const radiosity::ExchangeMatrix& exchange,
                           std::vector<radiosity::FirstBounceRow> rows, const ProbePoints& points, const ProbeFit& fit,
                           const radiosity::GatherHits& hits, const BakeOptions& options, const Progress& progress,
                           BasisVolume& volume, BakeReport& report, StageClock& clock) {
  SurfaceLightReport surfaces;
  detail::sharpen_nodes(volume.partition, rows);
  const auto light = surface_light(problem.elements, exchange, std::move(rows), options.clusters,
                                   {.tolerance = options.tolerance, .store = options.store}, progress, surfaces);
  if (!light)
    return light.error();
  report.solve = surfaces.solve;
  report.energy = surfaces.energy;
  clock.finish("solve");
  const auto one = [&](std::uint32_t point, float* nine_rows) { hits.weights(point, nine_rows); };
  const auto gather = [&](std::span<const std::uint32_t> some, float* rows_of_some) {
    fit.apply(some, 9 * hits.elements, one, rows_of_some);
  };
  auto compact = compact_sky(*light, gather, volume.probes, points.probe, volume.partition,
                             {.error = options.compact_error}, progress, &report.compact);
  if (!compact)
    return compact.error();
  report.regions_stored = static_cast<int>(report.compact.nodes);
  report.first_bounce.regions_skipped = report.regions - report.regions_stored;
  volume.compact = std::make_shared<const CompactBasis>(std::move(*compact));
  clock.finish("fine sky");
  return {};
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

  // One element of a fine sky sees some of thousands of nodes: rows, not a table.
  const bool fine = partition.interpolated();
  auto rows = fine ? radiosity::first_bounce_rows(elements, problem->mesh, problem->patch_rays, problem->apertures.list,
                                                  partition, progress, &report.first_bounce)
                   : Result<std::vector<radiosity::FirstBounceRow>>(std::vector<radiosity::FirstBounceRow>{});
  if (!rows)
    return rows.error();
  const auto light = fine ? Result<radiosity::FirstBounce>(radiosity::FirstBounce{})
                          : radiosity::first_bounce(elements, problem->mesh, problem->patch_rays,
                                                    problem->apertures.list, partition, progress, &report.first_bounce);
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

  const auto held_out = held_out_light(*problem, file.room, *probes, options, progress);
  if (!held_out)
    return held_out.error();
  if (options.audit)
    clock.finish("held-out skies");

  const ProbePoints points(*probes, problem->mesh.origin);
  std::vector<glm::dvec3> held_out_points = held_out->audit ? held_out->audit->points() : std::vector<glm::dvec3>{};
  for (glm::dvec3& p : held_out_points)
    p -= problem->mesh.origin;
  radiosity::GatherHits hits;
  if (fine) {
    hits =
        radiosity::gather_hits(points.at, elements, problem->mesh, problem->patch_rays, {.rays = options.gather_rays});
    clock.finish("rays");
  }
  Result<Transported> transported = Transported{};
  if (!fine || options.audit) {
    transported = Transport(*problem, *exchange, options, progress, report, clock)
                      .run(fine ? without_columns(held_out->skies) : *light, held_out->skies, points.at,
                           fine ? &hits : nullptr, held_out_points);
    if (!transported)
      return transported.error();
  }
  BasisVolume volume{.partition = partition,
                     .probes = std::move(*probes),
                     .stored_region = {},
                     .basis = {},
                     .compact = {},
                     .room = file.room,
                     .apertures = problem->apertures.list,
                     .provenance = {}};
  const ProbeFit fit = fit_to_interpolation(*problem, volume.probes, points.probe);
  const std::size_t count = std::max<std::size_t>(points.probe.size(), 1);
  fit.apply(transported->regions, transported->regions.size() / count);
  fit.apply(transported->skies_at_probes, transported->skies_at_probes.size() / count);
  if (fine) {
    const Result<void> done = bake_fine_sky(*problem, *exchange, std::move(*rows), points, fit, hits, options, progress,
                                            volume, report, clock);
    if (!done)
      return done.error();
  } else {
    volume.stored_region = light->region;
    store_basis(transported->regions, points.probe, light->columns(), volume);
  }
  if (held_out->audit) {
    report.audit =
        held_out->audit->judge(volume, transported->skies_at_points, transported->skies_at_probes, points.probe);
    clock.finish("audit");
  }
  return volume;
}

} // namespace daylit::precompute
