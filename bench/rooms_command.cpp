// daylit-bench rooms: the models that people have, generated: written down with points at which light is wanted.

#include <algorithm>
#include <filesystem>
#include <memory>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "bench/command.h"
#include "bench/real_rooms.h"
#include "scene/core/atomic_file.h"
#include "scene/room/room_formats.h"

namespace daylit::bench {
namespace {

struct Arguments {
  std::vector<std::string> rooms;
  std::filesystem::path folder;
};

const char* const kLibrary = "rooms.mtl";

nlohmann::json triple(const glm::dvec3& p) { return {p.x, p.y, p.z}; }

/// NAME.obj, NAME.json with the places and their points, NAME.points: those of the first place.
Result<nlohmann::json> write_room(const RealRoom& room, const std::filesystem::path& folder) {
  const std::filesystem::path model = folder / (room.name + ".obj");
  if (const auto written = write_file_atomically(model, room.model.obj(kLibrary)); !written)
    return written.error();
  const auto file = read_room(model);
  if (!file)
    return file.error();
  nlohmann::json json = {{"room", room.name},
                         {"about", room.about},
                         {"model", model.filename().string()},
                         {"polygons", room.model.faces()},
                         {"triangles", file->room.triangles.size()},
                         {"places", nlohmann::json::array()}};
  std::string first_points;
  for (const Place& place : room.places) {
    const auto points = points_in(room, file->room, place);
    if (!points)
      return points.error();
    nlohmann::json list = nlohmann::json::array();
    for (const glm::dvec3& p : *points) {
      list.push_back(triple(p));
      if (&place == &room.places.front())
        first_points += fmt::format("{} {} {}\n", p.x, p.y, p.z);
    }
    json["places"].push_back({{"name", place.name},
                              {"low", triple(place.air.low)},
                              {"high", triple(place.air.high)},
                              {"lit", place.lit},
                              {"inside", list[0]},
                              {"points", list}});
  }
  for (const auto& [ending, text] :
       {std::pair<const char*, std::string>{".points", first_points}, {".json", json.dump(1) + "\n"}})
    if (const auto written = write_file_atomically(folder / (room.name + ending), text); !written)
      return written.error();
  return json;
}

Result<std::vector<RealRoom>> chosen(const std::vector<std::string>& names) {
  std::vector<RealRoom> all = real_rooms();
  for (const std::string& name : names)
    if (std::none_of(all.begin(), all.end(), [&](const RealRoom& r) { return r.name == name; }))
      return Error{ErrorCode::usage, "no generated room is called '" + name + "'", "--rooms",
                   "school, hall, home, louvres, atrium, furnished or dim"};
  if (!names.empty())
    std::erase_if(all, [&](const RealRoom& r) { return std::find(names.begin(), names.end(), r.name) == names.end(); });
  return all;
}

Result<void> run(const Arguments& a, const CommonOptions& options) {
  const auto rooms = chosen(a.rooms);
  if (!rooms)
    return rooms.error();
  std::error_code failed;
  std::filesystem::create_directories(a.folder, failed);
  if (const auto written = write_file_atomically(a.folder / kLibrary, real_rooms_mtl()); !written)
    return written.error();
  nlohmann::json document = {{"rooms", nlohmann::json::array()}};
  for (const RealRoom& room : *rooms) {
    const auto written = write_room(room, a.folder);
    if (!written)
      return written.error();
    document["rooms"].push_back(*written);
    if (!options.json)
      fmt::print("{:<10} {:6d} polygons {:7d} triangles  {}\n", room.name, (*written)["polygons"].get<int>(),
                 (*written)["triangles"].get<int>(), (a.folder / (room.name + ".obj")).string());
  }
  return deliver(document, options);
}

} // namespace

Command add_rooms(CLI::App& program) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* parser = program.add_subcommand("rooms", "models as people have them: school, hall, home, furniture");
  parser->add_option("--rooms", arguments->rooms, "school, hall, home, louvres, atrium, furnished, dim (default: all)")
      ->delimiter(',');
  parser->add_option("--write", arguments->folder, "folder for models, points and what is in them")->required();
  return {parser, [arguments](const CommonOptions& options) { return run(*arguments, options); }};
}

} // namespace daylit::bench
