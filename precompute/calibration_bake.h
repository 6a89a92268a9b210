#pragma once

// Two quick coarse bakes that say how hard a room is: what its mesh, its grid and its part of the
// sky cost in error.

#include <algorithm>

#include "precompute/bake.h"

namespace daylit::precompute {

/// One of the two: what later bakes on finer meshes are compared with.
struct CalibrationMesh {
  std::size_t facets = 0;
  double facet_edge_m = 0;
  double mean_facet_m2 = 0; ///< BakeReport::mean_facet_m2
  AuditReport audit;        ///< points for the audits to come, and the coefficients there
};

/// What the two found. Errors are nrms of the coefficients, without the noise of the rays.
struct CalibrationBake {
  Bounds bounds; ///< of the room, or of the box where light is wanted, world metres
  Bounds box;    ///< BakeOptions::box: as asked for, or of the air where that is less than half of the model
  CalibrationMesh coarse, fine;
  std::size_t probes = 0;     ///< in the air, of the finer bake
  double spacing_m = 0;       ///< of the finer bake, geometric mean of the three axes
  double air_fraction = 1;    ///< of the grid's probes
  double stored_fraction = 1; ///< of the regions: those that windows see
  double seen_fraction = 1;   ///< of the area that the sky lights, by one place: of several rooms little
  int channels = 3;
  std::size_t fixed_facets = 0; ///< of both meshes, that the faces make by themselves

  /// Of the finer mesh: those that an edge length decides.
  double free_facets() const { return static_cast<double>(std::max<std::size_t>(fine.facets - fixed_facets, 1)); }
  double mesh_error = 0;             ///< of the finer mesh
  double grid_error = 0;             ///< at `spacing_m`, worst smooth sky
  double grid_sun = 0;               ///< the same, rms over small suns; 0: no sun comes in
  ProbeDensity density;              ///< where the light of the finer bake is curved
  Planes near_surfaces;              ///< where probes must be, whatever the light is
  std::vector<glm::dvec3> receivers; ///< where the light is wanted (BakeOptions::receivers)
  std::vector<glm::dvec3> standing;  ///< points for the audits to come: where objects stand
  std::vector<RoomPoints> rooms;     ///< the same room by room
  double gather_rays = 0, visibility_rays = 0;
  std::vector<StageTime> stages; ///< of the finer bake
  double seconds = 0;            ///< of both
};

/// `points`: where the volume is wanted; empty: anywhere in the room's air, or in a `box` of it. Errors of the bake.
/// `stand_on`: material of the faces on which objects will stand; empty: all level ones. Probes and points of audits
/// stand close above these.
/// `memory_bytes`: BakeOptions::memory_bytes.
Result<CalibrationBake> run_calibration_bake(const RoomFile& room, const std::vector<glm::dvec3>& points,
                                             const Bounds& box, const std::string& stand_on, double memory_bytes,
                                             const Progress& progress);

/// Geometric mean of the distances of neighbouring probes.
double mean_spacing(const Bounds& room, const glm::ivec3& probes);

} // namespace daylit::precompute
