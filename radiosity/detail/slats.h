#pragma once

#include <vector>

#include "radiosity/detail/plane_groups.h"
#include "scene/core/result.h"
#include "scene/room/room.h"

namespace daylit::radiosity {

/// Adds lines to the groups of a room (coordinates relative to `origin`) that cut slats lengthwise into four strips, in
/// which triangles are long. Between slats the light falls off from one long side to the other within the width of a
/// slat; as one facet it would send as much of it into the room as out (ISO 15099:2003 cuts the slats of a blind in the
/// same way, into five). A slat: half of a rectangle, at least four times as long as wide, with a surface in front of
/// most of it closer than its width, and the gap between them open at a long side, as the inside of a board is not.
/// Errors of the ray scene.
Result<void> cut_slats(const Room& room, const glm::dvec3& origin, std::vector<PlaneGroup>& groups);

} // namespace daylit::radiosity
