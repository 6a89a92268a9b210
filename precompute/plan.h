#pragma once

// From an error to settings. Calibration bakes measure the room, the cost model carries what they found to other
// settings, and the plan is the cheapest choice whose predicted error stays below the target, with a reserve.

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

/// What the user has fixed; the plan decides all else.
struct PlanRequest {
  double max_error = 0.02;        ///< of the coefficients under smooth skies; a small sun may err twice as much
  double facet_edge_m = 0;        ///< > 0: fixed
  int facets = 0;                 ///< > 0: fixed
  glm::ivec3 grid{0};             ///< > 0: fixed
  double spacing_m = 0;           ///< > 0: fixed
  std::vector<glm::dvec3> points; ///< not empty: no grid
  Bounds box;                     ///< world metres, not empty: probes in here alone
  std::string stand_on;           ///< material on which objects will stand; empty: every level face
  /// Fixed: graded (true) or regular. Else graded where the plan chooses how many probes there are.
  std::optional<bool> graded;
  std::string regions;             ///< not empty: fixed
  std::optional<ShOrder> sh_order; ///< fixed
  /// False: what was fixed may make the target impossible, and the rest is planned as if it did not.
  bool must_reach = true;
  double memory_bytes = 0; ///< BakeOptions::memory_bytes
  double seconds = 0;      ///< > 0: that the whole bake may take; decides max_error (error_in_time())
  bool once = false;       ///< no second bake where the first misses max_error
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

/// The smallest error, two digits of per cent, whose plan is predicted to end within `seconds`.
/// Error limit_exceeded: none up to 20 % does, with the shortest time; or make_plan()'s for 20 %.
Result<double> error_in_time(const CalibrationBake& calibration, PlanRequest request, double seconds);

/// Lines for a person, before the bake.
std::string to_text(const Plan& plan);

} // namespace daylit::precompute
