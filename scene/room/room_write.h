#pragma once

// A room model written back: Wavefront OBJ and MTL that read_room() reads as the same room.

#include <filesystem>

#include "scene/core/output_file.h"
#include "scene/core/result.h"
#include "scene/room/room.h"

namespace daylit {

constexpr FileKind kRoomKind{"a room model of daylit", "# Room of daylit"};

/// The material file that write_room() puts beside the OBJ: the same name ending in .mtl.
std::filesystem::path material_file_of(const std::filesystem::path& obj);

/// Triangles by material; metres, z up, every digit of the coordinates. The material file is written first.
Result<void> write_room(const std::filesystem::path& obj, const Room& room);

} // namespace daylit
