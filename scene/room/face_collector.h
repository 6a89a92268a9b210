#pragma once

#include <string>

#include "scene/core/result.h"
#include "scene/format/obj_text.h"
#include "scene/room/room.h"
#include "scene/room/room_formats.h"

namespace daylit::detail {

/// Turns the polygons of a file into the triangles of a room, whose vertices and materials are there already. Drops,
/// counts and names what has no area or is there twice. Errors: an outline that crosses itself, the same face of two
/// materials, no face left.
Result<void> collect_faces(const ObjText& faces, const std::string& name, Room& room, RoomReport& report);

} // namespace daylit::detail
