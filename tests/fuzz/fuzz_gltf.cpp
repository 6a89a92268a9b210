// Any bytes as a glTF room, text or binary: an error or a room whose indices are in range.

#include <cstdint>
#include <cstdlib>

#include "scene/room_formats.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace daylit;
  const auto read_file = [data, size](const std::string&) {
    return Result<std::vector<std::uint8_t>>(std::vector<std::uint8_t>(data, data + size));
  };
  const Result<RoomFile> file = parse_gltf_room({data, size}, "fuzz.gltf", read_file);
  if (!file)
    return 0;
  for (const RoomTriangle& t : file->room.triangles)
    if (t.material >= file->room.materials.size() || t.vertex[0] >= file->room.vertices.size() ||
        t.vertex[1] >= file->room.vertices.size() || t.vertex[2] >= file->room.vertices.size())
      std::abort();
  return 0;
}
