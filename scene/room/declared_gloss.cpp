#include "scene/room/declared_gloss.h"

#include <algorithm>

#include <fmt/format.h>

#include "scene/core/lower_case.h"

namespace daylit {

namespace {

/// "floor", "white"
std::string surface_names(const Room& room) {
  std::vector<std::string> names;
  for (const RoomTriangle& t : room.triangles)
    if (const std::string& name = room.material(t).name;
        !room.is_window(t) && std::ranges::find(names, name) == names.end())
      names.push_back(name);
  return fmt::format("\"{}\"", fmt::join(names, "\", \""));
}

} // namespace

Result<std::vector<float>> declared_gloss(const Room& room, const std::map<std::string, double>& glossy) {
  std::vector<float> mirrored(room.triangles.size(), 0.0f);
  for (const auto& [name, part] : glossy) {
    bool found = false;
    for (std::size_t t = 0; t < mirrored.size(); ++t)
      if (!room.is_window(room.triangles[t]) && same_name(room.material(room.triangles[t]).name, name)) {
        mirrored[t] = static_cast<float>(part);
        found = true;
      }
    if (!found)
      return Error{ErrorCode::not_found, fmt::format("no surface of the room has the material \"{}\"", name),
                   "[room] glossy", "its materials are " + surface_names(room)};
  }
  return mirrored;
}

} // namespace daylit
