#include "precompute/pilot.h"

#include <algorithm>
#include <cmath>

#include "precompute/plan_laws.h"
#include "precompute/room_frame.h"

namespace daylit::precompute {

namespace {

constexpr int kPatches = 640, kRegions = 64;
constexpr double kProbes = 900;
constexpr double kVisibilityRays = 16384; // more change the error of the light by less than a thousandth of itself
constexpr int kGatherRays = 1024;
constexpr std::size_t kPoints = 64;

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
  options.target_patches = kPatches / 2;
  options.visibility_rays = kVisibilityRays;
  options.gather_rays = kGatherRays;
  options.spacing_m = pilot_spacing(pilot.bounds);
  options.audit = true;
  options.held_out = share_of(points);
  BakeReport coarse, fine;
  const auto first = bake_room(room, sky, options, progress, coarse);
  if (!first)
    return first.error();
  options.target_patches = kPatches;
  options.held_out = coarse.audit.points;
  const auto second = bake_room(room, sky, options, progress, fine);
  if (!second)
    return second.error();
  pilot.patches = fine.patches;
  pilot.probes = fine.probes_valid;
  pilot.patch_edge_m = fine.patch_edge_m;
  pilot.spacing_m = mean_spacing(pilot.bounds, second->probes.count);
  pilot.air_share = static_cast<double>(fine.probes_valid) / static_cast<double>(std::max<std::size_t>(fine.probes, 1));
  pilot.stored_share = static_cast<double>(fine.regions_stored) / fine.regions;
  pilot.channels = fine.solve.channels;
  // The law of halving at the ratio that the mesher really gave.
  const double ratio =
      static_cast<double>(fine.patches) / static_cast<double>(std::max<std::size_t>(coarse.patches, 1));
  const double of_difference = kPlanLaws.mesh_of_halving * (std::pow(2.0, kPlanLaws.mesh_exponent) - 1.0) /
                               std::max(std::pow(ratio, kPlanLaws.mesh_exponent) - 1.0, 0.1);
  pilot.mesh_error = of_difference * mesh_difference(coarse.audit, fine.audit);
  pilot.grid_error = fine.audit.smooth(&SkyError::grid_part);
  pilot.grid_sun = fine.audit.sun(&SkyError::grid_part);
  pilot.gather_rays = options.gather_rays;
  pilot.visibility_rays = options.visibility_rays;
  pilot.stages = fine.stages;
  pilot.seconds = coarse.total_seconds + fine.total_seconds;
  pilot.audit = std::move(fine.audit);
  return pilot;
}

} // namespace daylit::precompute
