#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "scene/result.h"
#include "scene/room.h"

namespace daylit {

enum class UpAxis { z, y };

struct RoomReport {
  std::size_t faces_read = 0;
  std::size_t zero_area_faces = 0; ///< dropped, counted
  std::size_t duplicate_faces = 0; ///< dropped, counted
  std::vector<std::string> notes;  ///< one line per thing a user should know
};

struct RoomFile {
  Room room;
  RoomReport report;
  std::string content_hash; ///< FNV-1a of geometry and materials, 16 hex digits
};

/// Reads an OBJ (+ MTL) room. Coordinates are metres; `up` y turns (x, y, z) -> (x, -z, y).
/// Errors: file missing, unparsable, non-finite vertex, index out of range, reflectance outside 0..1, no face left.
Result<RoomFile> read_room(const std::filesystem::path& path, UpAxis up = UpAxis::z);

} // namespace daylit
