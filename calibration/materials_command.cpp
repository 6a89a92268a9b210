// daylit-calibrate materials: reflectances of the room's surfaces from photographs of known pose.

#include <memory>

#include "calibration/command.h"
#include "calibration/material_report.h"
#include "scene/room/room_write.h"

namespace daylit::calibration {

namespace {

struct MaterialsOptions {
  std::vector<std::filesystem::path> masks;
};

Result<void> run(CommonOptions& o, const MaterialsOptions& options) {
  if (o.output.extension() != ".obj")
    return Error{ErrorCode::usage, "'" + o.output.string() + "' does not end in .obj", "--output",
                 "the room model is written as OBJ, its materials beside it"};
  const auto scene = read_material_scene(o.inputs, options.masks);
  if (!scene)
    return scene.error();
  ProgressLine progress(o.quiet || o.json);
  const auto transport =
      RoomTransport::make(scene->room.room, {scene->skies.begin(), scene->skies.end()}, progress.callback());
  if (!transport)
    return transport.error();
  const auto found = calibrate_materials(*scene, **transport, progress.callback());
  progress.clear();
  if (!found && found.error().code == ErrorCode::not_found) {
    Report nothing;
    nothing.title = "Reflectances of the room";
    return deliver_without_result(o, nothing, {found.error().what + "; " + found.error().hint});
  }
  if (!found)
    return found.error();
  if (const Result<void> good = check_output(material_file_of(o.output), kRoomKind, o.force); !good)
    return good;
  return deliver_result(o, kRoomKind, found->report, [&] { return write_room(o.output, found->room); });
}

} // namespace

Command add_materials_command(CLI::App& app, CommonOptions& o) {
  const auto options = std::make_shared<MaterialsOptions>();
  CLI::App* command = app.add_subcommand("materials", "reflectances of the room's surfaces from photographs of it");
  add_common_options(*command, o,
                     "a CONFIG.toml of daylit-run for each photograph: [sky], [interior], [pose], [room] model",
                     "the room model to write (.obj and .mtl): the same room with the reflectances that were found");
  command->add_option("--mask", options->masks,
                      "for each photograph a picture of its size, white where something hides the room; - for none");
  return {command, [&o, options] { return run(o, *options); }};
}

} // namespace daylit::calibration
