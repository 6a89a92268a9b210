#pragma once

// What a finished bake turned out to be, beside what was predicted.

#include <string>

#include "precompute/plan.h"

namespace daylit::precompute {

/// Errors of a finished bake, nrms: the audit's, and the mesh's from the calibration bake's coefficients beside its
/// own.
struct Measured {
  double mesh = 0, volume = 0, total = 0, irradiance = 0, sun = 0;
  std::string worst_sky;
  std::size_t points = 0;
};
Measured measured_error(const CalibrationBake& calibration, const BakeReport& report);

/// The calibration bake as it would have been had it known what a bake by `plan` measured.
CalibrationBake corrected(const CalibrationBake& calibration, const Plan& plan, const BakeReport& report);

/// Lines for a person, after the bake.
std::string to_text(const Plan& plan, const Measured& measured);

} // namespace daylit::precompute
