#include "scene/volume/room_model.h"

#include "scene/room/room_formats.h"

namespace daylit {

Result<void> check_room_model(const std::filesystem::path& model, const VolumeProvenance& volume) {
  if (model.empty() || volume.room_hash.empty())
    return {};
  for (const UpAxis up : {UpAxis::z, UpAxis::y}) {
    const auto room = read_room(model, up);
    if (!room)
      return room.error();
    if (room->content_hash == volume.room_hash)
      return {};
  }
  return Error{ErrorCode::value_invalid, "the volume was baked from another room (" + volume.room_name + ")",
               model.string() + ", [room] model", "bake the room again, or correct [room]"};
}

} // namespace daylit
