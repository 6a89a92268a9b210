// Any bytes as an OBJ file, and as the MTL file it names: an error, or a room or an object whose indices are in range.

#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "scene/model/mtl_material.h"
#include "scene/room/room_formats.h"
#include "tests/fuzz/check_mesh.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace daylit;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const std::size_t cut = text.find('\0');
  const std::string_view library = cut == std::string_view::npos ? std::string_view() : text.substr(cut + 1);
  const auto read_library = [library](const std::string&) { return Result<std::string>(std::string(library)); };
  if (auto soup = detail::parse_obj_soup({data, size}, "/nowhere/fuzz.obj", Rgb(0.5f)))
    check_object(std::move(*soup));
  if (const auto materials = detail::parse_mtl_text(library, "fuzz.mtl"))
    for (const detail::MtlMaterial& m : *materials)
      if (const auto made = detail::material_from_mtl(m, Rgb(0.5f), "fuzz.mtl"); made && !check_material(*made, ""))
        std::abort();
  const Result<RoomFile> file = parse_obj_room(text.substr(0, cut), "fuzz.obj", read_library);
  if (!file)
    return 0;
  for (const RoomTriangle& t : file->room.triangles)
    if (t.material >= file->room.materials.size() || t.vertex[0] >= file->room.vertices.size() ||
        t.vertex[1] >= file->room.vertices.size() || t.vertex[2] >= file->room.vertices.size())
      std::abort();
  return 0;
}
