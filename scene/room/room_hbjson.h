#pragma once

// Rooms from Honeybee models (.hbjson). Source: the Honeybee schema, model and radiance parts (ladybug.tools).

#include <string>
#include <string_view>

#include "scene/room/room_formats.h"

namespace daylit {

/// Faces, apertures, doors and shades, with and without a room, as diffuse surfaces and panes; apertures are cut out
/// of their faces. Reflectances are those of the Radiance modifiers (radiance_material.h): the face's own, else of the
/// modifier set of its room, else of the model, else Honeybee's generic ones. A wall between two rooms is one face
/// with the mean of both reflectances; air boundaries are open. Lengths are turned to metres by the model's units.
/// Errors: not the JSON of a model, a geometry that is no polygon, an aperture that crosses the edge of its face, a
/// modifier that is not there or of a type that is not read.
Result<RoomFile> parse_hbjson_room(std::string_view text, const std::string& name);

} // namespace daylit
