#pragma once

// A room baked to an error: calibration, plan, bake, measurement, and once more with better knowledge where that was
// not enough.

#include <functional>

#include "precompute/measured_error.h"

namespace daylit::precompute {

struct PlannedBake {
  CalibrationBake calibration;
  Plan plan; ///< of the bake that counts
  BakeReport report;
  Measured measured;
  BasisVolume volume;
  bool repeated = false; ///< the first bake missed the target
};

/// `announce` is called with each plan before its bake starts, and with what a bake that misses measured.
/// `store`: of the bakes, may be null; the second keeps its records apart from the first's.
/// Errors of calibration, plan and bake. A target that is missed in the end is no error: `measured` says so.
Result<PlannedBake> bake_to_error(const RoomFile& room, const PlanRequest& request, radiosity::WorkStore* store,
                                  const Progress& progress, const std::function<void(const std::string&)>& announce);

/// The report with the plan and what was measured, as to_json(BakeReport).
std::string to_json(const PlannedBake& bake, bool times = true);

} // namespace daylit::precompute
