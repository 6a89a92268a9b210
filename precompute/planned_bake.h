#pragma once

// A room baked to an error: calibration, plan, bake, measurement, and once more with better knowledge where that was
// not enough.

#include <functional>
#include <string>

#include "precompute/plan.h"

namespace daylit::precompute {

/// Errors of a finished bake, nrms: the audit's, and the mesh's from the calibration bake's coefficients beside its
/// own.
struct Measured {
  double mesh = 0, volume = 0, total = 0, irradiance = 0, sun = 0;
  double limited = 0; ///< total, where no point counts for much: what decides whether to bake once more
  double standing = 0, standing_sun = 0; ///< irradiance 1 to 30 cm above level faces
  std::string worst_sky;
  std::size_t points = 0, standing_points = 0;
  struct OfRoom {
    Bounds box; ///< world metres
    std::size_t points = 0;
    RoomErrors errors; ///< of the irradiance, relative to the light there
  };
  std::vector<OfRoom> rooms; ///< the largest first
};
Measured measured_error(const CalibrationBake& calibration, const BakeReport& report);

/// The calibration bake as it would have been had it known what a bake by `plan` measured.
CalibrationBake corrected(const CalibrationBake& calibration, const Plan& plan, const BakeReport& report);

/// In each room the 95th percentile is at most what was asked under smooth skies, and twice that under suns. False
/// without rooms.
bool all_met(const Plan& plan, const Measured& measured);

/// Lines for a person, after the bake.
std::string to_text(const Plan& plan, const Measured& measured);
/// The part of it that warns: empty where the error is as wanted.
std::string missed_text(const Plan& plan, const Measured& measured);

/// What a bake to an error, or in a time, begins with.
struct BakePlan {
  PlanRequest request; ///< with the max_error that a time decided
  CalibrationBake calibration;
  Plan plan;
};
/// Errors of the calibration bakes and of the plan, or of error_in_time().
Result<BakePlan> plan_bake(const RoomFile& room, const PlanRequest& request, const Progress& progress);

struct PlannedBake {
  CalibrationBake calibration;
  Plan plan; ///< of the bake that counts
  BakeReport report;
  Measured measured;
  BasisVolume volume;
  bool repeated = false; ///< the first bake missed the target
};

/// Why what a bake showed, `better`, cannot meet the target, or only with far more work than was announced: a file more
/// than twice as large. Empty where it can. Independent of the machine, as all that decides about the result.
std::string against_a_second_bake(const Plan& first, const Result<Plan>& better);

/// `announce` is called with each plan before its bake starts, and with what a bake that misses measured.
/// `store`: of the bakes, may be null; the second keeps its records apart from the first's.
/// Errors of calibration, plan and bake. A target that is missed in the end is no error: `measured` says so.
Result<PlannedBake> bake_to_error(const RoomFile& room, const PlanRequest& request, radiosity::WorkStore* store,
                                  const Progress& progress, const std::function<void(const std::string&)>& announce);
/// The same from what plan_bake() found.
Result<PlannedBake> bake_planned(const RoomFile& room, BakePlan planned, radiosity::WorkStore* store,
                                 const Progress& progress, const std::function<void(const std::string&)>& announce);

/// The report with the plan and what was measured, as to_json(BakeReport).
std::string to_json(const PlannedBake& bake, bool times = true);

} // namespace daylit::precompute
