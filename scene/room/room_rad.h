#pragma once

// Rooms from Radiance scenes (.rad): polygons of plastic, metal, trans, glass and light.

#include <string>
#include <string_view>

#include "scene/core/read_file.h"
#include "scene/room/room_formats.h"

namespace daylit {

/// Surfaces of glass are panes, whatever their name; the other materials are diffuse (radiance_material.h). `!xform`
/// is followed through `read_file`, to which it gives the name of the file as written; any other command is an error.
/// A source is left out: the sky comes apart from the room. Errors: as parse_obj_room(); surfaces other than polygons,
/// types of material that are not read, a modifier that is not defined.
Result<RoomFile> parse_rad_room(std::string_view text, const std::string& name, const ReadFile& read_file,
                                UpAxis up = UpAxis::z);

} // namespace daylit
