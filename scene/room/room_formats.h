#pragma once

// Room models on disk. Wavefront OBJ + MTL: `Kd` is the linear Lambertian reflectance, `Tf r g b` of a window
// material its transmittance (1 when absent; `d` and `Tr` are not used, exporters disagree on their meaning). A window
// material with `illum 7` is clear glass: the angle-dependent slab of index `Ni` (1.52 when absent,
// scene/room/glass.h), times Tf. Everything else about appearance is ignored. Read strictly: a line that is not
// understood is an error with its number, never skipped.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "scene/core/read_file.h"
#include "scene/core/result.h"
#include "scene/room/room.h"

namespace daylit {

enum class UpAxis { z, y };

struct RoomReport {
  std::size_t faces_read = 0;      ///< polygons in the file
  std::size_t zero_area_faces = 0; ///< dropped; the first ones are named in the notes
  std::size_t duplicate_faces = 0; ///< the same: outline and material of an earlier face, whatever the winding
  bool counted_in_faces = false;   ///< places are numbers of faces, not of lines
  std::vector<std::string> notes;  ///< one line per thing a user should know
};

struct RoomFile {
  Room room;
  RoomReport report;
  std::string content_hash; ///< of geometry and materials, 16 hex digits
};

/// Reads an OBJ (+ MTL) or glTF (.gltf, .glb) room. Coordinates are metres; `up` y turns (x, y, z) -> (x, -z, y) (OBJ;
/// glTF is y up by definition). Errors: file missing (also a named MTL), unparsable, non-finite vertex, index out of
/// range, unknown material, reflectance outside 0..1, face whose outline crosses itself, the same face
/// of two materials, no face left.
Result<RoomFile> read_room(const std::filesystem::path& path, UpAxis up = UpAxis::z);

/// The same from memory. `read_library` returns the text of an MTL file named in the OBJ.
using ReadLibrary = std::function<Result<std::string>(const std::string& file_name)>;
Result<RoomFile> parse_obj_room(std::string_view text, const std::string& name, const ReadLibrary& read_library,
                                UpAxis up = UpAxis::z);

/// glTF 2.0, text or binary, from memory; frame turned to z up: (x, y, z) -> (x, -z, y), node transforms in double.
/// Reflectance = base colour factor (linear) times the mean of the base colour texture (sRGB decoded, reported); window
/// transmittance = base colour times transmission factor of KHR_materials_transmission, else 1; KHR_materials_ior makes
/// it clear glass. `read_file` returns a file named in the model (buffers, textures). Errors: as above; node cycles,
/// ranges outside their buffers, extensions that are required and unknown, sparse or quantised positions.
Result<RoomFile> parse_gltf_room(std::span<const std::uint8_t> bytes, const std::string& name,
                                 const ReadFile& read_file);

/// XXH64 of vertices, triangles and materials: equal rooms have equal hashes whatever file they came from.
std::string content_hash(const Room& room);

} // namespace daylit
