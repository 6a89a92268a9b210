#pragma once

// What is looked for in a room before anything is computed; bake and check do it alike and say it in the same words.

#include <string>
#include <vector>

#include "scene/core/result.h"
#include "scene/room/aperture.h"
#include "scene/room/gaps.h"
#include "scene/room/room_formats.h"

namespace daylit::precompute {

struct RoomSurvey {
  Apertures apertures;                ///< found after gaps were closed
  Gaps gaps;                          ///< that are left
  double gap_light = 0;               ///< area of the gaps over that of the openings, each times its transmittance
  std::vector<std::string> questions; ///< things that are allowed but often a mistake
};

/// Error value_invalid: a room longer than a kilometre, which is one in other units.
Result<void> check_extent(const Room& room);

/// Closes gaps up to `close_gaps_m` (0: none) and says so in the notes of the file, whose hash then changes; finds the
/// others. `survey` holds what was found before an error. Errors: check_extent(); no daylight can enter.
Result<void> survey_room(RoomFile& file, double close_gaps_m, RoomSurvey& survey);

} // namespace daylit::precompute
