#include "scene/room/room_write.h"

#include <fmt/format.h>

#include "scene/core/atomic_file.h"

namespace daylit {

namespace {

std::string material_text(const Material& m) {
  std::string out = fmt::format("newmtl {}\nKd {} {} {}\n", m.name, m.reflectance.r, m.reflectance.g, m.reflectance.b);
  if (m.is_window) {
    out += fmt::format("Tf {} {} {}\n", m.transmittance.r, m.transmittance.g, m.transmittance.b);
    if (m.refractive_index >= 1.0f)
      out += fmt::format("illum 7\nNi {}\n", m.refractive_index);
  }
  return out;
}

} // namespace

std::filesystem::path material_file_of(const std::filesystem::path& obj) {
  return std::filesystem::path(obj).replace_extension(".mtl");
}

Result<void> write_room(const std::filesystem::path& obj, const Room& room) {
  const std::filesystem::path library = material_file_of(obj);
  std::string materials = std::string(kRoomKind.start) + ": Kd is the reflectance\n";
  for (const Material& m : room.materials)
    materials += material_text(m);
  std::string text = fmt::format("{}: metres, z up\nmtllib {}\n", kRoomKind.start, library.filename().string());
  for (const glm::dvec3& v : room.vertices)
    text += fmt::format("v {} {} {}\n", v.x, v.y, v.z);
  for (std::uint32_t m = 0; m < room.materials.size(); ++m) {
    text += fmt::format("usemtl {}\n", room.materials[m].name);
    for (const RoomTriangle& t : room.triangles)
      if (t.material == m)
        text += fmt::format("f {} {} {}\n", t.vertex[0] + 1, t.vertex[1] + 1, t.vertex[2] + 1);
  }
  if (const Result<void> written = write_file_atomically(library, materials); !written)
    return written;
  return write_file_atomically(obj, text);
}

} // namespace daylit
