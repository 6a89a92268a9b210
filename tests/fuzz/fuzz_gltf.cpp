// Any bytes as glTF, text or binary: a room or an object whose indices are in range, or an error.

#include <cstdint>
#include <cstdlib>

#include "scene/room/room_formats.h"
#include "tests/fuzz/check_mesh.h"

namespace {

using namespace daylit;

void read_as_room(std::span<const std::uint8_t> bytes, const ReadFile& read_file) {
  const Result<RoomFile> file = parse_gltf_room(bytes, "fuzz.gltf", read_file);
  if (!file)
    return;
  for (const RoomTriangle& t : file->room.triangles)
    if (t.material >= file->room.materials.size() || t.vertex[0] >= file->room.vertices.size() ||
        t.vertex[1] >= file->room.vertices.size() || t.vertex[2] >= file->room.vertices.size())
      std::abort();
}

void read_as_object(std::span<const std::uint8_t> bytes, const ReadFile& read_file) {
  auto soup = detail::parse_gltf_soup(bytes, "fuzz.gltf", read_file, Rgb(0.5f));
  if (soup)
    check_object(std::move(*soup));
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto read_file = [data, size](const std::string&) {
    return Result<std::vector<std::uint8_t>>(std::vector<std::uint8_t>(data, data + size));
  };
  read_as_room({data, size}, read_file);
  read_as_object({data, size}, read_file);
  return 0;
}
