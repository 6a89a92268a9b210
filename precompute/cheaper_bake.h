#pragma once

// What a bake that takes long, or more memory than it may, could do instead.

#include <string>

#include "precompute/planned_bake.h"

namespace daylit::precompute {

/// Bytes that the bake of a plan holds at once, from the counts of its first stage.
Result<double> memory_of(const RoomFile& room, const Plan& plan, const Progress& progress);

/// The refusal of a bake that needs too much memory, with the smallest error, in steps of a half, that needs less.
Error with_offer(Error refusal, const RoomFile& room, const CalibrationBake& calibration, PlanRequest request,
                 const Progress& progress);

/// Lines for a person where a plan takes more than ten minutes or 8 GB: what it takes, and up to three ways to ask for
/// less with what each is predicted to take. Else empty. Errors of count_room_bake().
Result<std::string> cheaper_text(const RoomFile& room, const BakePlan& planned, const Progress& progress);

} // namespace daylit::precompute
