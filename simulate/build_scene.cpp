#include "simulate/build_scene.h"

#include <algorithm>
#include <iterator>
#include <memory>
#include <optional>
#include <utility>

#include "scene/model/mesh_edit.h"
#include "scene/placing/read_object.h"
#include "scene/placing/set_down.h"
#include "scene/room/room_formats.h"

namespace daylit {

namespace {

/// All objects of the scene in world coordinates, as one mesh.
Result<ObjectMesh> read_objects(const std::vector<ObjectConfig>& objects, const Room& room,
                                std::vector<std::string>* warnings) {
  ObjectMesh all;
  const auto rays = RayScene::build(room);
  if (!rays)
    return rays.error();
  for (const ObjectConfig& given : objects) {
    auto mesh = read_object(given, warnings);
    if (!mesh)
      return mesh.error();
    const WeighedMesh weighed(*mesh);
    const auto placed = set_down(given, weighed, room, *rays);
    if (!placed)
      return placed.error();
    if (warnings)
      std::ranges::move(standing_warnings(*placed, weighed, room, *rays), std::back_inserter(*warnings));
    if (const auto added = append_mesh(all, std::move(*mesh), object_transform(*placed)); !added)
      return added.error();
  }
  return all;
}

Result<SkyLight> sky_light(const SimulateConfig& config, std::vector<std::string>* notes) {
  if (!config.has_sky_picture())
    return SkyLight(config.sky_model);
  auto picture = read_sky(config.run.sky, notes);
  if (!picture)
    return picture.error();
  return SkyLight(std::make_shared<const SkyImage>(*std::move(picture)));
}

} // namespace

Result<TraceScene> build_scene(const SimulateConfig& config, std::vector<std::string>* warnings) {
  const auto room = read_room(config.run.room_model);
  if (!room)
    return room.error();
  const auto object = read_objects(config.run.objects, room->room, warnings);
  if (!object)
    return object.error();
  std::optional<MarkerBoard> board;
  if (config.marker_board)
    board = MarkerBoard::printed(*config.run.marker);
  const auto sky = sky_light(config, warnings);
  if (!sky)
    return sky.error();
  auto scene = TraceScene::of_room(room->room, *sky, &*object, glm::dmat4(1.0), board);
  if (!scene)
    return scene.error();
  if (const auto declared = scene->declare_glossy(room->room, config.run.glossy_room); !declared)
    return declared.error();
  return scene;
}

} // namespace daylit
