// Any bytes as a Honeybee model: a room whose indices are in range, or an error.

#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "scene/room/room_hbjson.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace daylit;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto file = parse_hbjson_room(text, "fuzz.hbjson");
  if (!file)
    return 0;
  for (const RoomTriangle& t : file->room.triangles)
    for (const std::uint32_t v : t.vertex)
      if (t.material >= file->room.materials.size() || v >= file->room.vertices.size())
        std::abort();
  return 0;
}
