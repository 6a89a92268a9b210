// daylit-bench rooms: the models that people have, generated: written down with points at which light is wanted, baked
// by the program itself, and compared with path tracing at these points: time, memory, file, claimed and measured
// error.

#include <algorithm>
#include <filesystem>
#include <memory>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "bench/command.h"
#include "bench/real_rooms.h"
#include "bench/rooms_measure.h"
#include "scene/core/atomic_file.h"
#include "scene/room/room_formats.h"

namespace daylit::bench {
namespace {

struct Arguments {
  std::vector<std::string> rooms, cases;
  std::filesystem::path folder;
  int points = 0; ///< 0: each place's own
  MeasureSettings measure;
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

Result<nlohmann::json> write_rooms(const std::vector<RealRoom>& rooms, const std::filesystem::path& folder, bool tell) {
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (const auto written = write_file_atomically(folder / kLibrary, real_rooms_mtl()); !written)
    return written.error();
  nlohmann::json list = nlohmann::json::array();
  for (const RealRoom& room : rooms) {
    const auto written = write_room(room, folder);
    if (!written)
      return written.error();
    list.push_back(*written);
    if (tell)
      fmt::print("{:<10} {:6d} polygons {:7d} triangles  {}\n", room.name, (*written)["polygons"].get<int>(),
                 (*written)["triangles"].get<int>(), (folder / (room.name + ".obj")).string());
  }
  return list;
}

/// The worst place of a row counts.
void print_row(const nlohmann::json& row) {
  fmt::print("{:<14} {:7.1f} {:7.1f} {:6.2f} ", row["case"].get<std::string>(), row["wall_seconds"].get<double>(),
             row["cpu_seconds"].get<double>(), row["peak_gb"].get<double>());
  if (row.contains("failed")) {
    fmt::print(" {}\n", row["failed"].get<std::string>());
    return;
  }
  const auto claimed = [&](const char* key) {
    return 100 * row.value("claimed", nlohmann::json::object()).value(key, 0.0);
  };
  fmt::print("{:7.1f} {:7.2f} {:6.2f} {:>31}\n", row["file_mb"].get<double>(), claimed("error"), claimed("sun"),
             row["met"].get<bool>() ? "met" : "NOT MET");
  for (const nlohmann::json& place : row["places"])
    fmt::print(
        "    {:<40} {:8} {:7.2f} {:7.2f} {:7.2f} {:6.2f} {:6.2f}{}\n", place["place"].get<std::string>(), "",
        100 * place["sun_claimed"].get<double>(), 100 * place["sun_looking_in"].get<double>(),
        100 * place["smooth"].get<double>(), 100 * place["sun"].get<double>(), 100 * place["noise"].get<double>(),
        place["unknown_points"] == 0 ? ""
                                     : fmt::format("  {} points without light", place["unknown_points"].get<int>()));
}

Result<void> measure(const Arguments& a, const std::vector<RealRoom>& rooms, const CommonOptions& options) {
  nlohmann::json document = {{"machine", machine()}, {"rows", nlohmann::json::array()}};
  document["reference"] = {{"paths_per_point", a.measure.truth.samples}, {"suns", a.measure.truth.suns}};
  if (!options.json)
    fmt::print(
        "case            wall s   cpu s     GB      MB claimed    sun 95 % of suns: claimed, measured; smooth    sun  "
        "noise (%)\n");
  ProgressLine progress(options.quiet);
  for (const RoomCase& one : room_cases()) {
    const auto room = std::ranges::find_if(rooms, [&](const RealRoom& r) { return r.name == one.room; });
    if (room == rooms.end() || (!a.cases.empty() && std::ranges::find(a.cases, one.name) == a.cases.end()))
      continue;
    const auto row = measure_case(one, *room, a.measure, progress.callback());
    progress.clear();
    if (!row)
      return row.error();
    document["rows"].push_back(*row);
    if (!options.json)
      print_row(*row);
    std::fflush(stdout);
  }
  return deliver(document, options);
}

Result<void> run(const Arguments& a, const CommonOptions& options) {
  auto rooms = chosen(a.rooms);
  if (!rooms)
    return rooms.error();
  if (a.points > 0)
    for (RealRoom& room : *rooms)
      for (Place& place : room.places)
        place.points = a.points;
  const bool only_write = !a.folder.empty();
  const auto list = write_rooms(*rooms, only_write ? a.folder : a.measure.folder, only_write && !options.json);
  if (!list)
    return list.error();
  return only_write ? deliver({{"rooms", *list}}, options) : measure(a, *rooms, options);
}

} // namespace

Command add_rooms(CLI::App& program) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* parser =
      program.add_subcommand("rooms", "models as people have them, baked and compared: school, hall, home, furniture");
  parser->add_option("--rooms", arguments->rooms, "school, hall, home, louvres, atrium, furnished, dim (default: all)")
      ->delimiter(',');
  parser->add_option("--write", arguments->folder, "write the models and points into this folder, and bake nothing");
  MeasureSettings& m = arguments->measure;
  m.folder = std::filesystem::temp_directory_path() / "daylit-bench-rooms";
  std::vector<std::string> names;
  for (const RoomCase& one : room_cases())
    names.push_back(one.name);
  parser->add_option("--cases", arguments->cases, "school-points, school-inside, school-all, hall, ... (default: all)")
      ->delimiter(',')
      ->check(CLI::IsMember(names));
  parser->add_option("--bake-options", m.bake_options, "of daylit-precompute, instead of those of the case");
  parser->add_option("--folder", m.folder, "for models, volumes, logs and the reference, which is kept")
      ->capture_default_str();
  parser->add_option("--limit", m.limit_s, "seconds that a bake may take")->capture_default_str();
  parser->add_option("--points-per-place", arguments->points, "where light is compared (default: 24 to 72)")
      ->check(CLI::Range(1, 10000));
  parser->add_option("--samples", m.truth.samples, "paths per point and axis of the reference")
      ->check(CLI::Range(kBatches, 1 << 22))
      ->capture_default_str();
  parser->add_option("--suns", m.truth.suns, "further skies with the sun somewhere; the 95th percentile counts")
      ->check(CLI::Range(0, 1000));
  return {parser, [arguments](const CommonOptions& options) { return run(*arguments, options); }};
}

} // namespace daylit::bench
