#include "precompute/bake.h"

#include <algorithm>
#include <limits>

#include "precompute/detail/bake_stage.h"
#include "precompute/detail/more_rays.h"
#include "precompute/memory_need.h"
#include "precompute/probes.h"
#include "scene/core/parallel.h"

namespace daylit::precompute {

namespace {

using detail::LightElements;
using detail::ProbePoints;
using detail::Problem;

/// Nothing stands between neighbouring probes whose values are fitted together.
ProbeFit fit_of(const Problem& problem, const ProbePoints& points) {
  const RayScene& scene = problem.room_scene;
  const auto at = [&](std::size_t i) { return problem.probes.origin + glm::dvec3(problem.probes.positions[i]); };
  return ProbeFit::make(
      problem.probes, points.probe,
      [&](std::size_t a, std::size_t b) { return open_between(at(a), at(b), scene, problem.apertures.list); },
      [&](std::size_t i) {
        return static_cast<double>(scene.distance(scene.to_local(at(i)), std::numeric_limits<float>::infinity()));
      });
}

/// Direct light of all regions: rows per element of a fine sky, of whose thousands of nodes each sees some, or a table
/// per patch.
struct DirectLight {
  std::vector<radiosity::FirstBounceRow> rows;
  radiosity::FirstBounce table;
};

Result<DirectLight> direct_light(const Problem& problem, const LightElements& elements, const SkyPartition& partition,
                                 int directions, const Progress& progress, radiosity::FirstBounceReport& report) {
  DirectLight light;
  if (partition.interpolated()) {
    auto rows = radiosity::first_bounce_rows(elements.patches, elements.mesh, elements.rays, problem.apertures.list,
                                             partition, progress, &report, {directions});
    if (!rows)
      return rows.error();
    light.rows = std::move(*rows);
  } else {
    auto table = radiosity::first_bounce(problem.patches, problem.mesh, problem.facet_rays, problem.apertures.list,
                                         partition, progress, &report, {directions});
    if (!table)
      return table.error();
    light.table = std::move(*table);
  }
  return light;
}

/// Irradiance of each element under a white sky, mean of the channels. The elements of a table are its patches.
std::vector<float> white_light(const DirectLight& light, std::size_t elements) {
  std::vector<float> white(elements, 0.0f);
  for (std::size_t e = 0; e < light.rows.size(); ++e)
    for (const Rgb& x : light.rows[e].irradiance)
      white[e] += (x.r + x.g + x.b) / 3.0f;
  const radiosity::FirstBounce& table = light.table;
  for (std::size_t e = 0; e < table.patches; ++e)
    for (int c = 0; c < table.channels; ++c)
      for (std::size_t k = 0; k < table.columns(); ++k)
        white[e] += table.row(e, c)[k] / static_cast<float>(table.channels);
  return white;
}

radiosity::ExchangeOptions exchange_options(const BakeOptions& options) {
  return {.visibility_rays = options.visibility_rays,
          .low_rank_tolerance = options.low_rank_tolerance,
          .skip_black = true,
          .store = options.store};
}

Result<LightElements> light_elements(const Problem& problem, bool fine, const BakeOptions& options) {
  return LightElements::make(problem.mesh, problem.patches, problem.apertures.list, problem.room_scene, problem.field,
                             fine ? problem.mesh.facets.size() + options.more_elements : std::size_t{0});
}

/// Exchange areas whose rows are closed against the openings.
Result<radiosity::ExchangeMatrix> closed_exchange(const Problem& problem, const Room& room,
                                                  const std::vector<float>& opening, const BakeOptions& options,
                                                  const Progress& progress, BakeReport& report) {
  auto exchange = radiosity::exchange_areas(problem.patches, problem.mesh, room, problem.room_scene,
                                            exchange_options(options), progress, &report.exchange);
  if (exchange)
    report.closure = radiosity::close_rows(problem.patches, opening, {.black_left_out = true}, *exchange);
  return exchange;
}

/// Bytes of the form factors, none of which is computed, and of the whole bake.
Result<void> predict_memory(const Problem& problem, const Room& room, const SkyPartition& partition,
                            const BakeOptions& options, BakeReport& report) {
  const Result<double> bytes =
      radiosity::exchange_bytes(problem.patches, problem.mesh, room, exchange_options(options));
  if (!bytes)
    return bytes.error();
  report.exchange.bytes = static_cast<std::size_t>(*bytes);
  report.memory_bytes = needed_memory(report, partition, options);
  return {};
}

/// Hits of rays are kept in what is left beside those aimed at holes; the others are traced again.
std::size_t kept_bytes(const BakeOptions& options, double needed_bytes, std::size_t aiming_points) {
  constexpr std::size_t kMost = radiosity::GatherHits::kMostKeptBytes;
  if (options.memory_bytes <= 0)
    return kMost;
  const double left =
      options.memory_bytes - needed_bytes - static_cast<double>(aiming_points * radiosity::AimedRays::kMostBytes);
  return std::min(kMost, static_cast<std::size_t>(std::max(0.0, left)));
}

/// What the probes see: with rays through small holes, and more rays where those of all are too few.
Result<radiosity::GatherHits> seen_from(std::span<const glm::dvec3> points, const LightElements& elements,
                                        std::span<const radiosity::HoleOutline> holes,
                                        const radiosity::WholeFaces& faces, std::span<const float> white,
                                        const BakeOptions& options, double needed_bytes, const Progress& progress) {
  auto hits = radiosity::gather_hits(points, elements.patches, elements.mesh, elements.rays,
                                     {.rays = options.gather_rays, .group = elements.parent, .faces = &faces}, progress,
                                     kept_bytes(options, needed_bytes, holes.empty() ? 0 : points.size()));
  if (!hits)
    return hits.error();
  if (const Result<void> aimed = hits->aim_at(holes, white, progress); !aimed)
    return aimed.error();
  if (const Result<void> more = hits->add_rays(detail::more_rays(*hits, points, white, options.gather_rays), progress);
      !more)
    return more.error();
  return hits;
}

} // namespace

/// Settings without a plan, coarse to fine; given points have no neighbours on a grid that average their noise.
Result<BakeOptions> quality_options(const std::string& name, bool given_points) {
  BakeOptions o;
  if (name == "draft") {
    o.target_facets = 700;
    o.more_elements = 2900;
    o.gather_rays = 512;
    o.visibility_rays = 16384;
    o.spacing_m = 0.5;
  } else if (name == "high") {
    o.target_facets = 6000;
    o.more_elements = 0;
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

Result<BakeReport> count_bake(const RoomFile& file, const SkyPartition& partition, const BakeOptions& options) {
  BakeReport report;
  detail::StageClock clock(report);
  const Result<Problem> problem = detail::set_up(file.room, options, report, clock);
  if (!problem)
    return problem.error();
  const auto elements = light_elements(*problem, partition.interpolated(), options);
  if (!elements)
    return elements.error();
  report.elements = elements->patches.patches.size();
  if (const Result<void> memory = predict_memory(*problem, file.room, partition, options, report); !memory)
    return memory.error();
  return report;
}

namespace {

/// From the surfaces to the probes, and the audit of what they have then.
Result<void> fill_volume(const detail::Stage& stage, const Room& room, DirectLight light, BasisVolume& volume,
                         BakeReport& report) {
  std::vector<std::uint32_t> source;
  if (volume.partition.interpolated()) {
    auto sources = detail::bake_fine_sky(stage, std::move(light.rows), volume, report);
    if (!sources)
      return sources.error();
    source = std::move(*sources);
  } else if (const Result<void> done = detail::bake_regions(stage, light.table, volume, report); !done) {
    return done.error();
  }
  if (stage.options.audit) {
    auto audited = detail::audit_bake(stage, room, volume, source);
    if (!audited)
      return audited.error();
    report.audit = std::move(*audited);
  }
  return {};
}

} // namespace

/// Mesh and probes, direct light H, exchange areas G with closed rows, rays of the probes; then
/// L_lm = w (I - rho F)^-1 rho H by one of the two ways, and the audit.
Result<BasisVolume> bake(const RoomFile& file, const SkyPartition& partition, const BakeOptions& options,
                         const Progress& progress, BakeReport& report) {
  detail::StageClock clock(report);
  report.room = file.report;
  Result<Problem> problem = detail::set_up(file.room, options, report, clock);
  if (!problem)
    return problem.error();
  const bool fine = partition.interpolated();
  const auto elements = light_elements(*problem, fine, options);
  if (!elements)
    return elements.error();
  report.elements = elements->patches.patches.size();
  if (const Result<void> memory = predict_memory(*problem, file.room, partition, options, report); !memory)
    return memory.error();
  if (const Result<void> fits = check_memory(report.memory_bytes, options.memory_bytes); !fits)
    return fits.error();
  auto light = direct_light(*problem, *elements, partition, options.directions, progress, report.first_bounce);
  if (!light)
    return light.error();
  report.regions = partition.size();
  report.regions_stored = static_cast<int>(light->table.columns());
  clock.finish("first bounce");
  const std::vector<float> direct = white_light(*light, elements->patches.patches.size());
  if (std::ranges::all_of(direct, [](float e) { return e <= 0.0f; }))
    return Error{ErrorCode::geometry_invalid, "no daylight comes in: nothing that it would reach sees the sky", "room",
                 "see that the walls are cut open where the panes are, and that nothing closes them outside"};
  const auto exchange =
      closed_exchange(*problem, file.room, fine ? elements->opening_of_parents(light->rows) : light->table.opening,
                      options, progress, report);
  if (!exchange)
    return exchange.error();
  clock.finish("form factors");
  const ProbePoints points(problem->probes, problem->mesh.origin);
  const ProbeFit fit = fit_of(*problem, points);
  const auto faces = radiosity::WholeFaces::make(file.room, elements->mesh, elements->patches);
  const auto white = detail::grey_radiosity(problem->patches, *elements, *exchange, direct,
                                            {.tolerance = options.tolerance}, progress);
  if (!white)
    return white.error();
  const auto hits =
      seen_from(points.at, *elements, problem->holes, faces, *white, options, report.memory_bytes, progress);
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
  const detail::Stage stage{*problem, *elements, faces,   *exchange, points, *hits,
                            fit,      *white,    options, progress,  clock};
  if (const Result<void> done = fill_volume(stage, file.room, std::move(*light), volume, report); !done)
    return done.error();
  return volume;
}

} // namespace daylit::precompute
