#include "precompute/pilot.h"

#include <algorithm>
#include <cmath>

#include "precompute/plan_laws.h"
#include "precompute/room_frame.h"

namespace daylit::precompute {

namespace {

constexpr int kFacets = 640, kRegions = 64;
constexpr double kProbes = 900;
constexpr double kVisibilityRays = 16384; // more change the error of the light by less than a thousandth of itself
constexpr int kGatherRays = 1024;
constexpr double kCoarser = 1.4; ///< spacing of the coarser pilot
constexpr double kLeast = 1e-6;
constexpr std::size_t kPoints = 128;

/// A cube's worth of probes whatever the room's proportions; at least 3 along the shortest side.
double pilot_spacing(const Bounds& bounds) {
  const glm::dvec3 s = bounds.size();
  const double shortest = std::min({s.x, s.y, s.z});
  return std::max(std::min(std::cbrt(s.x * s.y * s.z / kProbes), 0.5 * shortest), 0.02 * std::max({s.x, s.y, s.z}));
}

std::vector<glm::dvec3> share_of(const std::vector<glm::dvec3>& points) {
  std::vector<glm::dvec3> out;
  const std::size_t step = std::max<std::size_t>(1, points.size() / kPoints);
  for (std::size_t i = 0; i < points.size(); i += step)
    out.push_back(points[i]);
  return out;
}

double grid_error(const BakeReport& report, bool sun) {
  const double error = sun ? report.audit.sun(&SkyError::grid_part) : report.audit.smooth(&SkyError::grid_part);
  return without_noise(error, kGatherRays);
}

/// The law of halving at the ratio that the mesher really gave.
double mesh_error(const Pilot& pilot) {
  const double ratio =
      static_cast<double>(pilot.fine.facets) / static_cast<double>(std::max<std::size_t>(pilot.coarse.facets, 1));
  const double of_difference = kPlanLaws.mesh_of_halving * (std::pow(2.0, kPlanLaws.mesh_exponent) - 1.0) /
                               std::max(std::pow(ratio, kPlanLaws.mesh_exponent) - 1.0, 0.1);
  return of_difference * mesh_difference(pilot.coarse.audit, pilot.fine.audit);
}

} // namespace

double mean_spacing(const Bounds& room, const glm::ivec3& probes) {
  const glm::dvec3 size = room.size();
  return std::cbrt(size.x / (probes.x - 1) * size.y / (probes.y - 1) * size.z / (probes.z - 1));
}

Result<Pilot> run_pilot(const RoomFile& room, const std::vector<glm::dvec3>& points, const Progress& progress) {
  Pilot pilot;
  pilot.bounds = room.room.bounds();
  const SkyPartition sky = *SkyPartition::uniform(kRegions);
  BakeOptions options;
  options.visibility_rays = kVisibilityRays;
  options.gather_rays = kGatherRays;
  options.audit = true;
  options.held_out = share_of(points);
  double log_grid = 0, log_sun = 0;
  BakeReport report;
  // Mesh and grid of the first are coarser: two meshes whose difference tells the error, two spacings for one law.
  for (const bool finer : {false, true}) {
    options.target_facets = finer ? kFacets : kFacets / 2;
    options.spacing_m = pilot_spacing(pilot.bounds) * (finer ? 1.0 : kCoarser);
    report = BakeReport{};
    const auto volume = bake_room(room, sky, options, progress, report);
    if (!volume)
      return volume.error();
    pilot.seconds += report.total_seconds;
    options.held_out = report.audit.points;
    (finer ? pilot.fine : pilot.coarse) = {report.facets, report.facet_edge_m, report.audit};
    pilot.spacing_m = mean_spacing(pilot.bounds, volume->probes.count);
    if (finer) {
      auto density = probe_density(*volume);
      if (!density)
        return density.error();
      pilot.density = std::move(*density);
    }
    const double reach = kPlanLaws.grid_exponent * std::log(pilot.spacing_m);
    log_grid += 0.5 * (std::log(std::max(grid_error(report, false), kLeast)) - reach);
    log_sun += 0.5 * (std::log(std::max(grid_error(report, true), kLeast)) - reach);
  }
  const double here = kPlanLaws.grid_exponent * std::log(pilot.spacing_m);
  pilot.grid_error = std::exp(log_grid + here);
  pilot.grid_sun = grid_error(report, true) > 0 ? std::exp(log_sun + here) : 0.0;
  pilot.mesh_error = mesh_error(pilot);
  pilot.probes = report.probes_valid;
  pilot.air_share =
      static_cast<double>(report.probes_valid) / static_cast<double>(std::max<std::size_t>(report.probes, 1));
  pilot.stored_share = static_cast<double>(report.regions_stored) / report.regions;
  pilot.channels = report.solve.channels;
  pilot.gather_rays = options.gather_rays;
  pilot.visibility_rays = options.visibility_rays;
  pilot.stages = report.stages;
  return pilot;
}

} // namespace daylit::precompute
