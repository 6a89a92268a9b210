#include "precompute/calibration_bake.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "precompute/cost_model.h"
#include "precompute/probes.h"
#include "precompute/room_around.h"
#include "precompute/room_frame.h"
#include "precompute/small_holes.h"

namespace daylit::precompute {

namespace {

constexpr int kCoarseFacets = 320, kRegions = 64;
constexpr double kProbes = 900;
constexpr double kVisibilityRays = 16384; // more change the error of the light by less than a thousandth of itself
constexpr int kDirections = 4096;         // of 64 regions: 64 for each
constexpr int kGatherRays = 1024;
constexpr double kCoarser = 1.4; ///< spacing of the coarser calibration bake
constexpr double kLeast = 1e-6;
constexpr std::size_t kPoints = 128, kCandidates = 64 * kPoints, kReceivers = 1024;
constexpr double kFewest = 256, kPerM3 = 0.25;    ///< points that look for the air's box: 20 within 3 m
constexpr double kSeeds_m = 0.3, kSameAir = 1.02; ///< from panes; a box that grows by less is the air's
constexpr int kRounds = 8;
constexpr double kOutdoors = 0.5;                           ///< of the bounds: with less air the model has outdoors
constexpr double kOffSurfaces_m = 0.2, kOffSurfaces = 0.04; ///< metres, and of the longest side: the smaller

/// A cube's worth of probes whatever the room's proportions; at least 3 along the shortest side.
double calibration_spacing(const Bounds& bounds) {
  const glm::dvec3 s = bounds.size();
  const double shortest = std::min({s.x, s.y, s.z});
  return std::max(std::min(std::cbrt(s.x * s.y * s.z / kProbes), 0.5 * shortest), 0.02 * std::max({s.x, s.y, s.z}));
}

/// They have a point in common.
bool meet(const Bounds& a, const Bounds& b) {
  for (int axis = 0; axis < 3; ++axis)
    if (a.max[axis] < b.min[axis] || b.max[axis] < a.min[axis])
      return false;
  return true;
}

/// Points in the air, spread over it, as close to surfaces as objects come.
Result<std::vector<glm::dvec3>> points_in_air(const Room& room, const RayScene& rays,
                                              const std::vector<Aperture>& apertures, const Bounds& bounds) {
  const glm::dvec3 size = bounds.size();
  const std::vector<glm::dvec3> candidates = spread_points(
      room, bounds, kCandidates, std::min(kOffSurfaces_m, kOffSurfaces * std::max({size.x, size.y, size.z})));
  const auto probes = make_points(candidates, room.bounds(), rays, apertures);
  if (!probes)
    return probes.error();
  std::vector<glm::dvec3> points;
  for (std::size_t i = 0; i < candidates.size(); ++i)
    if (probes->valid[i])
      points.push_back(candidates[i]);
  return points;
}

/// About `count` of them, evenly spread over the list.
std::vector<glm::dvec3> thinned(const std::vector<glm::dvec3>& points, std::size_t count) {
  std::vector<glm::dvec3> out;
  const std::size_t step = std::max<std::size_t>(1, points.size() / count);
  for (std::size_t i = 0; i < points.size(); i += step)
    out.push_back(points[i]);
  return out;
}

/// The box of the air that openings lead to, from points inside them; then of what points in it see, until it no longer
/// grows: doors lead on to further rooms.
Result<Bounds> air_behind(const Room& room, const RayScene& rays, const std::vector<Aperture>& apertures) {
  Bounds box = air_around(room, rays, apertures, air_seeds(apertures, kSeeds_m));
  for (int round = 0; round < kRounds && !box.empty(); ++round) {
    const auto points = points_in_air(room, rays, apertures, box);
    if (!points)
      return points.error();
    Bounds more = air_around(room, rays, apertures, thinned(*points, kPoints));
    more.include(box.min);
    more.include(box.max);
    if (volume(more) <= kSameAir * volume(box))
      break;
    box = more;
  }
  return box;
}

/// The box of the air. Where points over all the bounds rarely meet it (a house on a large ground), from the openings.
Result<Bounds> air_box(const Room& room, const RayScene& rays, const std::vector<Aperture>& apertures,
                       const Bounds& bounds, const std::vector<glm::dvec3>& in_air) {
  if (in_air.size() < kPoints)
    return air_behind(room, rays, apertures);
  const double looking = std::max(kFewest, kPerM3 * volume(bounds));
  return air_around(room, rays, apertures, thinned(in_air, static_cast<std::size_t>(looking)));
}

/// Interpolation error of the audit without the part that the rays of the probes add.
double grid_error_of(const BakeReport& report, bool sun) {
  const double error = sun ? report.audit.sun(&SkyError::grid_part) : report.audit.smooth(&SkyError::grid_part);
  return without_noise(error, kGatherRays);
}

/// Error of the finer mesh: c (2^a - 1) / (ratio^a - 1) of the difference, c measured at a ratio of 2
/// (CostModel::mesh_of_halving), at the ratio that the mesher really gave where light comes from.
double mesh_error_of(const CalibrationBake& calibration) {
  const double ratio = calibration.coarse.mean_facet_m2 / calibration.fine.mean_facet_m2;
  const double of_difference = kCostModel.mesh_of_halving * (std::pow(2.0, kCostModel.mesh_exponent) - 1.0) /
                               std::max(std::pow(ratio, kCostModel.mesh_exponent) - 1.0, 0.1);
  return of_difference * mesh_difference(calibration.coarse.audit, calibration.fine.audit);
}

/// Mean over both bakes of log(error / spacing^exponent): one law through two measurements, of smooth skies and suns.
class GridLaw {
public:
  void add(const BakeReport& report, double spacing_m) {
    smooth_ += 0.5 * (std::log(std::max(grid_error_of(report, false), kLeast)) - at(spacing_m));
    sun_ += 0.5 * (std::log(std::max(grid_error_of(report, true), kLeast)) - at(spacing_m));
  }
  double smooth(double spacing_m) const { return std::exp(smooth_ + at(spacing_m)); }
  double sun(double spacing_m) const { return std::exp(sun_ + at(spacing_m)); }

private:
  static double at(double spacing_m) { return kCostModel.grid_exponent * std::log(spacing_m); }
  double smooth_ = 0, sun_ = 0;
};

/// What the finer bake says beside its errors.
void take_counts(const BakeReport& report, const BakeOptions& options, CalibrationBake& calibration) {
  calibration.probes = report.probes_valid;
  calibration.fixed_facets = report.fixed_facets;
  calibration.air_fraction = static_cast<double>(report.probes_valid + report.probes_interpolated) /
                             static_cast<double>(std::max<std::size_t>(report.probes, 1));
  calibration.stored_fraction = static_cast<double>(report.regions_stored) / report.regions;
  calibration.seen_fraction = report.seen_fraction;
  calibration.channels = report.solve.channels;
  calibration.gather_rays = options.gather_rays;
  calibration.visibility_rays = options.visibility_rays;
  calibration.stages = report.stages;
}

/// Where light is wanted in a room without given points: in the air, room by room, and above the faces; and the planes
/// of probes near faces and around small holes. Of a building that stands outdoors only the box of the air counts.
Result<void> place_points(const Room& room, std::vector<StandingFace> faces, CalibrationBake& calibration,
                          BakeOptions& options) {
  const auto rays = RayScene::build(room);
  if (!rays)
    return rays.error();
  const auto apertures = find_apertures(room, *rays);
  if (!apertures)
    return apertures.error();
  auto in_air = points_in_air(room, *rays, apertures->list, calibration.bounds);
  if (!in_air)
    return in_air.error();
  if (!options.box.empty() && in_air->empty())
    return Error{
        ErrorCode::value_invalid, "no point of the box can be reached from an opening", "--inside or --box",
        "give a point, or a box, in the air of a room: this one is inside a wall or furniture, outdoors, or in a "
        "closed room"};
  if (options.box.empty()) {
    const auto air = air_box(room, *rays, apertures->list, calibration.bounds, *in_air);
    if (!air)
      return air.error();
    if (!air->empty() && volume(*air) < kOutdoors * volume(calibration.bounds)) {
      calibration.bounds = options.box = *air;
      in_air = points_in_air(room, *rays, apertures->list, *air);
      if (!in_air)
        return in_air.error();
    }
  }
  std::erase_if(faces, [&](const StandingFace& f) { return !meet(f.box, calibration.bounds); });
  auto standing = points_above(room, faces, 4 * kPoints);
  if (!standing)
    return standing.error();
  auto rooms = points_by_room(room, calibration.bounds, *in_air);
  if (!rooms)
    return rooms.error();
  calibration.near_surfaces = planes_near(faces, calibration.bounds);
  add_planes_near(small_holes(room, *rays, apertures->list), calibration.near_surfaces);
  options.near_surfaces = calibration.near_surfaces;
  add_planes_beside(faces, calibration.bounds, calibration.near_surfaces);
  calibration.standing = std::move(*standing);
  calibration.receivers = thinned(*in_air, kReceivers);
  calibration.rooms = std::move(*rooms);
  options.held_out = std::move(*in_air);
  return {};
}

} // namespace

/// ((sx / (nx - 1)) (sy / (ny - 1)) (sz / (nz - 1)))^(1/3), metres.
double mean_spacing(const Bounds& room, const glm::ivec3& probes) {
  const glm::dvec3 size = room.size();
  return std::cbrt(size.x / (probes.x - 1) * size.y / (probes.y - 1) * size.z / (probes.z - 1));
}

/// Two bakes at fixed settings, 320 facets and about 640, with edges by sqrt(2) shorter, about 330 and 900 probes, 64
/// regions: their differences show what of the error belongs to the mesh and what to the grid.
Result<CalibrationBake> run_calibration_bake(const RoomFile& room, const std::vector<glm::dvec3>& points,
                                             const Bounds& box, const std::string& stand_on, double memory_bytes,
                                             const Progress& progress) {
  CalibrationBake calibration;
  calibration.bounds = box.empty() ? room.room.bounds() : box;
  auto faces = standing_faces(room.room, stand_on);
  if (!faces)
    return faces.error();
  const SkyPartition sky = *SkyPartition::uniform(kRegions);
  BakeOptions options;
  options.visibility_rays = kVisibilityRays;
  options.directions = kDirections;
  options.gather_rays = kGatherRays;
  options.audit = true;
  options.memory_bytes = memory_bytes;
  options.points = thinned(points, kPoints);
  calibration.receivers = thinned(points, kReceivers);
  options.box = box;
  if (points.empty()) {
    if (const Result<void> placed = place_points(room.room, std::move(*faces), calibration, options); !placed)
      return placed.error();
  }
  options.receivers = calibration.receivers;
  calibration.box = options.box;
  GridLaw grid;
  BakeReport report;
  // Mesh and grid of the first are coarser: two meshes whose difference shows the error, two spacings for one law.
  for (const bool finer : {false, true}) {
    options.target_facets = kCoarseFacets;
    options.facet_edge_m = finer ? calibration.coarse.facet_edge_m / std::numbers::sqrt2 : 0.0;
    options.spacing_m = calibration_spacing(calibration.bounds) * (finer ? 1.0 : kCoarser);
    report = BakeReport{};
    const auto volume = bake_room(room, sky, options, progress, report);
    if (!volume)
      return volume.error();
    calibration.seconds += report.total_seconds;
    options.held_out = report.audit.points;
    (finer ? calibration.fine : calibration.coarse) = {report.facets, report.facet_edge_m, report.mean_facet_m2,
                                                       report.audit};
    calibration.spacing_m = mean_spacing(calibration.bounds, grid_size(calibration.bounds, options.spacing_m));
    grid.add(report, calibration.spacing_m);
    if (finer && points.empty()) {
      auto density = probe_density(*volume);
      if (!density)
        return density.error();
      calibration.density = std::move(*density);
    }
  }
  calibration.grid_error = grid.smooth(calibration.spacing_m);
  calibration.grid_sun = grid_error_of(report, true) > 0 ? grid.sun(calibration.spacing_m) : 0.0;
  calibration.mesh_error = mesh_error_of(calibration);
  take_counts(report, options, calibration);
  return calibration;
}

} // namespace daylit::precompute
