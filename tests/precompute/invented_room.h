#pragma once

#include "precompute/calibration_bake.h"

namespace daylit::precompute {

/// What calibration bakes could have found in a box of 4 x 5 x 2.8 m.
inline CalibrationBake invented_room(double mesh_error, double grid_error, double grid_sun) {
  CalibrationBake calibration;
  calibration.bounds.include({0, 0, 0});
  calibration.bounds.include({4, 5, 2.8});
  calibration.fine.facets = 640;
  calibration.fine.facet_edge_m = 0.7;
  calibration.probes = 800;
  calibration.spacing_m = 0.4;
  calibration.stored_fraction = 0.5;
  calibration.mesh_error = mesh_error;
  calibration.grid_error = grid_error;
  calibration.grid_sun = grid_sun;
  calibration.gather_rays = 1024;
  calibration.visibility_rays = 16384;
  calibration.stages = {{"volume", 0.2}, {"form factors", 0.2}};
  return calibration;
}

} // namespace daylit::precompute
