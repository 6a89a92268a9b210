#pragma once

#include <memory>
#include <optional>

#include "runtime/indirect/indirect_shadow.h"
#include "runtime/indirect/room_light.h"
#include "scene/room/ray_scene.h"
#include "scene/volume/volume.h"

namespace daylit {

/// The room of a session, read once. Its members refer to each other: it stays where it was made.
struct LoadedRoom {
  BasisVolume volume;
  LightFieldSampler sampler;
  RayScene rays;
  RoomLight light;
  std::optional<IndirectShadow> indirect_shadow; ///< empty: not drawn

  LoadedRoom(BasisVolume v, LightFieldSampler s, RayScene r, bool with_indirect_shadow);
  LoadedRoom(const LoadedRoom&) = delete;
  LoadedRoom& operator=(const LoadedRoom&) = delete;
};

/// Errors: of the volume file, of its probe grid, no ray scene.
Result<std::unique_ptr<LoadedRoom>> load_room(const std::filesystem::path& volume, bool with_indirect_shadow);

} // namespace daylit
