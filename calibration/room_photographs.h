#pragma once

// Lengths of a room plan from its photographs.

#include "calibration/room_plan.h"
#include "scene/core/program.h"

namespace daylit::calibration {

/// Sets size, cut and the lengths of windows that have markers. Errors: of lens and pictures, of measure_room(); a
/// window's marker that no photograph shows or that is on another surface; no height and no marker on the ceiling; a
/// marker on one wall of the cut only; interrupted.
Result<MeasuredRoom> measure_plan(RoomPlan& plan, const Progress& progress);

/// Prints that are not where the room has them, each with what to do.
std::vector<std::string> faults_of(const MeasuredRoom& measured);

} // namespace daylit::calibration
