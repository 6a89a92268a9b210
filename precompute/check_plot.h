#pragma once

// The room of a check as one page: surfaces, openings, gaps and where light would be baked, in three dimensions.

#include <string>

#include "precompute/room_check.h"

namespace daylit::precompute {

/// HTML that loads nothing: three.js and the data stand in it. About 20,000 probes at most are drawn.
/// Errors: of make_grid().
Result<std::string> check_page(const RoomCheck& check);

} // namespace daylit::precompute
