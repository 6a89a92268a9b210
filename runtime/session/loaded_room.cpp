#include "runtime/session/loaded_room.h"

#include <utility>

#include "scene/volume/volume_file.h"

namespace daylit {

LoadedRoom::LoadedRoom(BasisVolume v, LightFieldSampler s, RayScene r, bool with_indirect_shadow)
    : volume(std::move(v)), sampler(std::move(s)), rays(std::move(r)), light(volume.room, rays, sampler) {
  if (with_indirect_shadow)
    indirect_shadow.emplace(volume.room, rays, volume.apertures, light);
}

Result<std::unique_ptr<LoadedRoom>> load_room(const std::filesystem::path& path, bool with_indirect_shadow) {
  auto volume = read_volume(path);
  if (!volume)
    return volume.error();
  auto sampler = LightFieldSampler::make(*volume);
  if (!sampler)
    return sampler.error();
  auto rays = RayScene::build(volume->room);
  if (!rays)
    return rays.error();
  return std::make_unique<LoadedRoom>(std::move(*volume), std::move(*sampler), std::move(*rays), with_indirect_shadow);
}

} // namespace daylit
