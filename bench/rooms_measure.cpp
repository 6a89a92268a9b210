#include "bench/rooms_measure.h"

#include <algorithm>
#include <sstream>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "bench/room_bake.h"
#include "bench/volume_error.h"
#include "scene/core/seconds.h"
#include "scene/volume/volume_file.h"

namespace daylit::bench {

namespace {

using Json = nlohmann::json;

struct MeasuredPlace {
  const Place* place;
  std::vector<glm::dvec3> points;
};

/// All lit places of the room, in the order in which the truth has them.
Result<std::vector<MeasuredPlace>> lit_places(const RealRoom& room, const Room& geometry) {
  std::vector<MeasuredPlace> places;
  for (const Place& place : room.places) {
    if (!place.lit)
      continue;
    auto points = points_in(room, geometry, place);
    if (!points)
      return points.error();
    places.push_back({&place, std::move(*points)});
  }
  return places;
}

std::vector<std::string> bake_arguments(const RoomCase& one, const std::vector<MeasuredPlace>& places,
                                        const MeasureSettings& s) {
  std::vector<std::string> words{(s.folder / (one.room + ".obj")).string(), "-o",
                                 (s.folder / (one.name + ".volume")).string(), "--force", "--json"};
  std::istringstream options(s.bake_options.empty() ? one.options : s.bake_options);
  const glm::dvec3 inside = places[0].points[0];
  for (std::string word; options >> word;) {
    if (word == "{points}")
      word = (s.folder / (one.room + ".points")).string();
    else if (word == "{inside}")
      word = fmt::format("{},{},{}", inside.x, inside.y, inside.z);
    words.push_back(word);
  }
  return words;
}

/// Errors place by place, sky by sky; the worst of smooth skies and of suns beside their bars.
Json errors(const RoomCase& one, const std::vector<MeasuredPlace>& places, const std::vector<RoomTruth>& truth,
            const std::vector<IndirectLight>& lights, const Json& claimed) {
  Json rows = Json::array();
  std::size_t first = 0;
  for (std::size_t i = 0; i < places.size() && (i == 0 || !one.first_place); ++i) {
    Json row = place_error(places[i].points, first, truth, lights, claimed);
    row["place"] = places[i].place->name;
    row["smooth_bar"] = i < one.places.size() ? one.places[i] : one.smooth;
    row["sun_bar"] = one.sun;
    first += places[i].points.size();
    rows.push_back(std::move(row));
  }
  return rows;
}

bool within(double value, double bar) { return bar <= 0 || value <= bar; }

bool is_met(const RoomCase& one, const Json& row) {
  bool met = within(row["wall_seconds"], one.seconds) && within(row["peak_gb"], one.gigabytes) &&
             within(row["file_mb"], one.megabytes);
  for (const Json& place : row["places"])
    met = met && place["unknown_points"] == 0 && within(place["smooth"], place["smooth_bar"]) &&
          within(place["sun"], place["sun_bar"]);
  return met;
}

Json head(const RoomCase& one, const ProgramRun& run, const std::vector<std::string>& arguments) {
  return {{"case", one.name},
          {"options", std::vector<std::string>(arguments.begin() + 5, arguments.end())},
          {"exit_code", run.exit_code},
          {"wall_seconds", run.wall_s},
          {"cpu_seconds", run.cpu_s},
          {"peak_gb", run.peak_gb},
          {"bars", {{"seconds", one.seconds}, {"gigabytes", one.gigabytes}, {"megabytes", one.megabytes}}},
          {"met", false}};
}

} // namespace

const std::vector<RoomCase>& room_cases() {
  static const std::vector<RoomCase> cases = {
      {"school-points", "school", "--points {points}", true, 60, 4, 0, 0.02, 0.04},
      {"school-inside", "school", "--inside {inside}", true, 90, 4, 30, 0.02, 0.04},
      {"school-all", "school", "--max-error 4", false, 600, 8, 0, 0.04, 0.08},
      {"hall", "hall", "", false, 120, 4, 200, 0.02, 0.04},
      {"home", "home", "", false, 120, 4, 200, 0.03, 0},
      {"louvres", "louvres", "", false, 120, 4, 0, 0.03, 0.05},
      {"atrium", "atrium", "", false, 0, 0, 0, 0, 0},
      {"furnished", "furnished", "--max-error 4", false, 600, 8, 0, 0.04, 0.08},
      {"dim", "dim", "", false, 0, 0, 0, 0.15, 0, {0.02, 0.15}}};
  return cases;
}

Result<Json> measure_case(const RoomCase& one, const RealRoom& room, const MeasureSettings& settings,
                          const Progress& progress) {
  const auto file = read_room(settings.folder / (one.room + ".obj"));
  if (!file)
    return file.error();
  const auto places = lit_places(room, file->room);
  if (!places)
    return places.error();
  const std::vector<std::string> arguments = bake_arguments(one, *places, settings);
  const auto run = run_program_of_build("daylit-precompute", arguments, settings.limit_s, settings.folder / one.name);
  if (!run)
    return run.error();
  Json row = head(one, *run, arguments);
  if (run->exit_code != 0) {
    row["failed"] = run->out_of_time ? fmt::format("no end within {:.0f} s", settings.limit_s) : run->last_words;
    return row;
  }
  const std::filesystem::path path = settings.folder / (one.name + ".volume");
  row["file_mb"] = static_cast<double>(std::filesystem::file_size(path)) / 1e6;
  for (const char* key : {"plan", "predicted", "measured"})
    if (run->report.is_object() && run->report.contains(key))
      row[key == std::string_view("measured") ? "claimed" : key] = run->report[key];
  std::vector<TruthPoints> points;
  for (const MeasuredPlace& place : *places)
    points.push_back({place.points, place.place->mouth});
  const auto truth = room_truth(*file, points, settings.truth, settings.folder / (one.room + ".truth.json"), progress);
  if (!truth)
    return truth.error();
  const auto volume = read_volume(path);
  if (!volume)
    return volume.error();
  const auto scene = rays_of_light(*volume);
  if (!scene)
    return scene.error();
  const auto lights = lights_under(*truth, *volume, *scene);
  if (!lights)
    return lights.error();
  row["places"] = errors(one, *places, *truth, *lights, row.value("claimed", Json::object()));
  row["met"] = is_met(one, row);
  return row;
}

} // namespace daylit::bench
