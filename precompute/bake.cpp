#include "precompute/bake.h"

#include <algorithm>
#include <numeric>
#include <span>

#include "precompute/detail/light_elements.h"
#include "precompute/detail/node_sharpening.h"
#include "precompute/detail/transport_problem.h"
#include "precompute/probe_fit.h"
#include "precompute/probes.h"
#include "radiosity/coefficients.h"

namespace daylit::precompute {

namespace {

using detail::LightElements;
using detail::ProbePoints;
using detail::Problem;
using detail::StageClock;

/// [point][coefficient][channel * regions + region] -> [region][probe][coefficient][channel]
std::vector<float> rows_of(const std::vector<float>& coefficients, const std::vector<std::size_t>& probe_of_point,
                           std::size_t regions, const BasisVolume& volume) {
  std::vector<float> basis(regions * volume.row_floats(), 0.0f);
  for (std::size_t p = 0; p < probe_of_point.size(); ++p)
    for (std::size_t l = 0; l < 9; ++l)
      for (std::size_t c = 0; c < 3; ++c) {
        const float* from = coefficients.data() + ((p * 9 + l) * 3 + c) * regions;
        float* to = basis.data() + probe_of_point[p] * 27 + l * 3 + c;
        for (std::size_t r = 0; r < regions; ++r)
          to[r * volume.row_floats()] = from[r];
      }
  return basis;
}

/// All regions of the sky at once, for the audit when no region is solved by itself.
radiosity::FirstBounce whole_sky(const radiosity::FirstBounce& light) {
  radiosity::FirstBounce one{
      .patches = light.patches, .channels = light.channels, .region = {0}, .irradiance = {}, .opening = light.opening};
  for (std::size_t i = 0; i < light.patches; ++i)
    for (int c = 0; c < light.channels; ++c)
      one.irradiance.push_back(
          static_cast<float>(std::accumulate(light.row(i, c), light.row(i, c) + light.columns(), 0.0)));
  return one;
}

/// What all ways to the volume share. Points are the valid probes; `fit` turns light there into probe values.
struct Stage {
  const Problem& problem;
  const LightElements& elements; ///< constant regions: the patches themselves
  const radiosity::WholeFaces& faces;
  const radiosity::ExchangeMatrix& exchange;
  const ProbePoints& points;
  const radiosity::GatherHits& hits; ///< elements seen from the points' places
  const ProbeFit& fit;
  const BakeOptions& options;
  const Progress& progress;
  StageClock& clock;

  /// Pieces of adjoint solves are kept for the nine coefficients only: those of l = 4 have the same names.
  radiosity::SolveOptions solve(radiosity::Bands bands = radiosity::Bands::low) const {
    return {.tolerance = options.tolerance, .store = bands == radiosity::Bands::low ? options.store : nullptr};
  }
};

/// Constant regions: the interior transport from the first light to the coefficients at the points, by whichever side
/// has fewer columns.
Result<void> bake_regions(const Stage& s, const radiosity::FirstBounce& light, BasisVolume& volume,
                          BakeReport& report) {
  report.adjoint = 9 * s.points.at.size() < light.columns();
  const radiosity::FirstBounce driving = report.adjoint ? whole_sky(light) : radiosity::FirstBounce{};
  const radiosity::FirstBounce& forward = report.adjoint ? driving : light;
  const auto radiosity =
      radiosity::solve_radiosity(s.problem.patches, s.exchange, forward, s.solve(), s.progress, &report.solve);
  if (!radiosity)
    return radiosity.error();
  report.energy = radiosity::audit_energy(s.problem.patches, s.exchange, forward, *radiosity, &report.closure);
  s.clock.finish("solve");
  volume.stored_region = light.region;
  for (const radiosity::Bands bands : {radiosity::Bands::low, radiosity::Bands::fourth}) {
    const bool low = bands == radiosity::Bands::low;
    if (!low && s.options.sh_order == ShOrder::second)
      continue;
    auto coefficients =
        report.adjoint ? radiosity::adjoint_coefficients(s.hits, s.problem.patches, s.exchange, light, s.solve(bands),
                                                         s.progress, low ? &report.solve : nullptr, bands)
                       : radiosity::gather_coefficients(s.hits, *radiosity, s.progress, bands);
    if (!coefficients)
      return coefficients.error();
    std::vector<float> of_probes = s.points.spread(std::move(*coefficients));
    if (low) // in a fine sky the fit would gather twice as much for the small part that l = 4 has in irradiance
      s.fit.apply(of_probes, 27 * light.columns());
    (low ? volume.basis : volume.band4) = rows_of(of_probes, s.points.probe, light.columns(), volume);
  }
  s.clock.finish("volume");
  return {};
}

/// A sky of nodes: the light on the surfaces node by node, then the factors from the surfaces to the probes.
Result<void> bake_fine_sky(const Stage& s, std::vector<radiosity::FirstBounceRow> rows, BasisVolume& volume,
                           BakeReport& report) {
  SurfaceLightReport surfaces;
  detail::sharpen_nodes(volume.partition, rows);
  const auto light = surface_light(s.problem.patches, s.elements, s.exchange, std::move(rows), s.options.clusters,
                                   s.solve(), s.progress, surfaces);
  if (!light)
    return light.error();
  report.solve = surfaces.solve;
  report.energy = surfaces.energy;
  s.clock.finish("solve");
  const auto distinguished = [&](std::span<const std::uint32_t> some, std::span<std::uint8_t> of_patches) {
    for (const std::uint32_t point : s.fit.needed(some))
      s.hits.mark_distinguished(s.points.place[point], of_patches);
  };
  const auto gather = [&](std::span<const std::uint32_t> some, std::span<const std::uint32_t> piece_end, float* out) {
    const auto one = [&](std::uint32_t point, float* nine_rows) {
      s.hits.weights(s.points.place[point], piece_end, nine_rows);
    };
    s.fit.apply(some, 9 * piece_end.size(), one, out);
  };
  GatherRows rows_of_points{distinguished, gather};
  if (s.options.sh_order == ShOrder::fourth)
    rows_of_points.band4_rows = [&](std::span<const std::uint32_t> some, std::span<const std::uint32_t> piece_end,
                                    float* out) {
      for (std::size_t i = 0; i < some.size(); ++i)
        s.hits.weights(s.points.place[some[i]], piece_end, out + i * 9 * piece_end.size(), radiosity::Bands::fourth);
    };
  auto compact = compact_sky(*light, rows_of_points, volume.probes, s.points.probe, volume.partition,
                             {.error = s.options.compact_error, .part = s.fit.part()}, s.progress, &report.compact);
  if (!compact)
    return compact.error();
  report.regions_stored = static_cast<int>(report.compact.nodes);
  report.first_bounce.regions_skipped = report.regions - report.regions_stored;
  volume.compact = std::make_shared<const CompactBasis>(std::move(*compact));
  s.clock.finish("fine sky");
  return {};
}

constexpr int kHeldOutRays = 4; ///< times those of a probe

/// Which points stand for some probes (increasing, as the points' own).
std::vector<std::uint32_t> points_of(const ProbePoints& points, const std::vector<std::size_t>& probes) {
  std::vector<std::uint32_t> list;
  for (std::uint32_t p = 0; p < points.probe.size(); ++p)
    if (std::ranges::binary_search(probes, points.probe[p]))
      list.push_back(p);
  return list;
}

/// Probe values of some points, [point][lm][column].
Result<std::vector<float>> fitted_coefficients(const Stage& s, const std::vector<std::uint32_t>& some,
                                               const radiosity::Radiosity& radiosity) {
  const std::vector<std::uint32_t> needed = s.fit.needed(some);
  std::vector<std::size_t> places;
  for (const std::uint32_t point : needed)
    places.push_back(s.points.place[point]);
  const auto values = radiosity::gather_coefficients(s.hits, places, radiosity, s.progress);
  if (!values)
    return values.error();
  const std::size_t count = 9 * radiosity.columns;
  const auto copy = [&](std::uint32_t point, float* to) {
    const auto at = std::ranges::lower_bound(needed, point) - needed.begin();
    std::copy_n(values->data() + static_cast<std::size_t>(at) * count, count, to);
  };
  std::vector<float> fitted(some.size() * count);
  s.fit.apply(some, count, copy, fitted.data());
  return fitted;
}

/// The error of the finished volume: held-out skies taken straight to the probes and to the held-out points.
Result<AuditReport> audit(const Stage& s, const Room& room, const BasisVolume& volume) {
  Result<Audit> audit = Audit::prepare(room, s.problem.apertures.list, volume.probes, s.options.held_out);
  if (!audit)
    return audit.error();
  const LightElements& elements = s.elements;
  const auto light = radiosity::first_bounce(elements.patches, elements.mesh, elements.rays, s.problem.apertures.list,
                                             held_out_partition(), s.progress);
  if (!light)
    return light.error();
  const radiosity::FirstBounce first = audit->first_light(*light, elements.patches),
                               of_parents = elements.of_parents(first);
  const auto solved = radiosity::solve_radiosity(s.problem.patches, s.exchange, of_parents,
                                                 {.tolerance = s.options.tolerance}, s.progress);
  if (!solved)
    return solved.error();
  const radiosity::Radiosity radiosity = elements.radiosity_of(*solved, of_parents, first);
  std::vector<glm::dvec3> points = audit->points();
  for (glm::dvec3& p : points)
    p -= s.problem.mesh.origin;
  const auto seen = radiosity::gather_hits(
      points, elements.patches, elements.mesh, elements.rays,
      {.rays = kHeldOutRays * s.options.gather_rays, .group = elements.parent, .faces = &s.faces}, s.progress);
  if (!seen)
    return seen.error();
  const auto at_points = radiosity::gather_coefficients(*seen, radiosity, s.progress);
  if (!at_points)
    return at_points.error();
  const auto band4 = radiosity::gather_coefficients(*seen, radiosity, s.progress, radiosity::Bands::fourth);
  if (!band4)
    return band4.error();
  const std::vector<std::uint32_t> some = points_of(s.points, audit->probes());
  const auto at_probes = fitted_coefficients(s, some, radiosity);
  if (!at_probes)
    return at_probes.error();
  std::vector<std::size_t> probes;
  for (const std::uint32_t point : some)
    probes.push_back(s.points.probe[point]);
  AuditReport report = audit->judge(volume, *at_points, *band4, *at_probes, probes);
  s.clock.finish("audit");
  return report;
}

/// Nothing stands between neighbouring probes whose values are fitted together.
ProbeFit fit_of(const Problem& problem, const ProbePoints& points) {
  const ProbeSet& probes = problem.probes;
  return ProbeFit::make(probes, points.probe, [&](std::size_t a, std::size_t b) {
    const auto at = [&](std::size_t i) { return probes.origin + glm::dvec3(probes.positions[i]); };
    return open_between(at(a), at(b), problem.room_scene, problem.apertures.list);
  });
}

} // namespace

Result<BakeOptions> quality_options(const std::string& name, bool given_points) {
  BakeOptions o;
  if (name == "draft") {
    o.target_facets = 700;
    o.gather_rays = 512;
    o.visibility_rays = 16384;
    o.spacing_m = 0.5;
  } else if (name == "high") {
    o.target_facets = 6000;
    o.visibility_rays = 524288;
    o.gather_rays = 8192;
    o.spacing_m = 0.2;
  } else if (name != "normal") {
    return Error{ErrorCode::usage, "unknown quality '" + name + "'", "--quality", "use draft, normal or high"};
  }
  if (given_points) {
    o.target_facets = o.target_facets * 8 / 5;
    o.gather_rays *= 2;
  }
  return o;
}

Result<BasisVolume> bake(const RoomFile& file, const SkyPartition& partition, const BakeOptions& options,
                         const Progress& progress, BakeReport& report) {
  StageClock clock(report);
  report.room = file.report;
  Result<Problem> problem = detail::set_up(file.room, options, report, clock);
  if (!problem)
    return problem.error();
  const radiosity::PatchSet& patches = problem->patches;

  // One patch of a fine sky sees some of thousands of nodes: rows, not a table.
  const bool fine = partition.interpolated();
  const auto elements = LightElements::make(problem->mesh, patches, problem->apertures.list, problem->room_scene,
                                          fine ? options.elements : std::size_t{0});
  if (!elements)
    return elements.error();
  report.elements = elements->patches.patches.size();
  auto rows = fine ? radiosity::first_bounce_rows(elements->patches, elements->mesh, elements->rays,
                                                  problem->apertures.list, partition, progress, &report.first_bounce)
                   : Result<std::vector<radiosity::FirstBounceRow>>(std::vector<radiosity::FirstBounceRow>{});
  if (!rows)
    return rows.error();
  const auto light = fine ? Result<radiosity::FirstBounce>(radiosity::FirstBounce{})
                          : radiosity::first_bounce(patches, problem->mesh, problem->facet_rays,
                                                    problem->apertures.list, partition, progress, &report.first_bounce);
  if (!light)
    return light.error();
  report.regions = partition.size();
  report.regions_stored = static_cast<int>(light->columns());
  clock.finish("first bounce");

  auto exchange = radiosity::exchange_areas(patches, problem->mesh, file.room, problem->room_scene,
                                            {.visibility_rays = options.visibility_rays,
                                             .low_rank_tolerance = options.low_rank_tolerance,
                                             .skip_black = true,
                                             .store = options.store},
                                            progress, &report.exchange);
  if (!exchange)
    return exchange.error();
  report.closure = radiosity::close_rows(patches, fine ? elements->opening_of_parents(*rows) : light->opening,
                                         {.black_left_out = true}, *exchange);
  clock.finish("form factors");

  const ProbePoints points(problem->probes, problem->mesh.origin);
  const ProbeFit fit = fit_of(*problem, points);
  const auto faces = radiosity::WholeFaces::make(file.room, elements->mesh, elements->patches);
  const auto hits =
      radiosity::gather_hits(points.at, elements->patches, elements->mesh, elements->rays,
                             {.rays = options.gather_rays, .group = elements->parent, .faces = &faces}, progress);
  if (!hits)
    return hits.error();
  clock.finish("rays");
  BasisVolume volume{.partition = partition,
                     .probes = std::move(problem->probes),
                     .stored_region = {},
                     .basis = {},
                     .compact = {},
                     .room = file.room,
                     .apertures = problem->apertures.list,
                     .provenance = {}};
  const Stage stage{*problem, *elements, faces, *exchange, points, *hits, fit, options, progress, clock};
  if (const Result<void> done =
          fine ? bake_fine_sky(stage, std::move(*rows), volume, report) : bake_regions(stage, *light, volume, report);
      !done)
    return done.error();
  if (options.audit) {
    auto audited = audit(stage, file.room, volume);
    if (!audited)
      return audited.error();
    report.audit = std::move(*audited);
  }
  return volume;
}

} // namespace daylit::precompute
