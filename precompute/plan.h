#pragma once

// From an error to settings. A calibration bake measures the room, the cost model carry what it found to other
// settings, and the plan is the cheapest choice whose predicted error stays below what was asked, with a reserve.

#include <optional>
#include <string>

#include "precompute/bake.h"
#include "precompute/calibration_bake.h"
#include "scene/volume/volume_file.h"

namespace daylit::precompute {

/// What a bake with these settings would be like. Errors: nrms of the coefficients at points off the grid.
struct Prediction {
  double mesh = 0, grid = 0, sky = 0; ///< parts under smooth skies
  double total = 0;                   ///< root of the sum of their squares
  double sun = 0;                     ///< all parts under a small sun, 0: none comes in
  double seconds = 0;                 ///< whole run, calibration bakes included
  double bytes = 0;                   ///< file
};

/// What the user has fixed; all else is the plan's.
struct PlanRequest {
  double max_error = 0.02;        ///< of the coefficients under smooth skies; a small sun may err twice as much
  double facet_edge_m = 0;        ///< > 0: fixed
  int facets = 0;                 ///< > 0: fixed
  glm::ivec3 grid{0};             ///< > 0: fixed
  double spacing_m = 0;           ///< > 0: fixed
  std::vector<glm::dvec3> points; ///< not empty: no grid
  /// Fixed: graded (true) or regular. Else graded where the plan chooses how many probes there are.
  std::optional<bool> graded;
  std::string regions;             ///< not empty: fixed
  std::optional<ShOrder> sh_order; ///< fixed
  /// False: what was fixed may make the target impossible, and the rest is planned as if it did not.
  bool must_reach = true;
};

struct Plan {
  BakeOptions options;
  std::string regions; ///< as SkyPartition::parse() reads it
  BasisPrecision precision = BasisPrecision::float32;
  double max_error = 0;
  Prediction predicted;
};

/// Pure function of its arguments; a smaller target never gives fewer facets, probes, rays or nodes.
/// Error value_invalid: the target is not a positive number or out of reach; names the smallest that can be planned.
Result<Plan> make_plan(const CalibrationBake& calibration, const PlanRequest& request);

/// The calibration bake as it would have been had it known what a bake by `plan` measured.
CalibrationBake corrected(const CalibrationBake& calibration, const Plan& plan, const BakeReport& report);

/// Measured error of a finished bake: the audit's, and the mesh's from the calibration bake's coefficients beside its
/// own.
struct Measured {
  double mesh = 0, volume = 0, total = 0, irradiance = 0, sun = 0;
  std::string worst_sky;
  std::size_t points = 0;
};
Measured measured_error(const CalibrationBake& calibration, const BakeReport& report);

/// Lines for a person: before and after.
std::string to_text(const Plan& plan);
std::string to_text(const Plan& plan, const Measured& measured);

} // namespace daylit::precompute
