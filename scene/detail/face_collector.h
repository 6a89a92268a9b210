#pragma once

#include <string>

#include "scene/detail/obj_text.h"
#include "scene/result.h"
#include "scene/room.h"
#include "scene/room_formats.h"

namespace daylit::detail {

/// Turns the polygons of a file into the triangles of a room, whose vertices and materials are there already. Drops and
/// counts what has no area or is there twice. Errors: an outline that crosses itself, no face left.
Result<void> collect_faces(const ObjText& faces, const std::string& name, Room& room, RoomReport& report);

} // namespace daylit::detail
