#pragma once

// [room] glossy of a configuration: real surfaces that are declared to mirror.

#include <map>
#include <string>
#include <vector>

#include "scene/core/result.h"
#include "scene/room/room.h"

namespace daylit {

/// Part of light seen face on that each triangle mirrors, 0 where nothing is declared. `glossy`: by material, the case
/// of names does not count. Error not_found: no surface of the room has that material; panes are none.
Result<std::vector<float>> declared_gloss(const Room& room, const std::map<std::string, double>& glossy);

} // namespace daylit
