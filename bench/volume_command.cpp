// daylit-bench volume: is a baked volume right? Its light beside path tracing of the room that it holds, in each of its
// rooms, under smooth skies and suns, and beside what the bake claimed.

#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "bench/chance.h"
#include "bench/command.h"
#include "bench/volume_error.h"
#include "scene/room/ray_scene.h"
#include "scene/volume/volume_file.h"

namespace daylit::bench {
namespace {

using Json = nlohmann::json;

struct Arguments {
  std::filesystem::path volume, truth;
  int points = 48;
  TruthSettings settings{.samples = 4096, .suns = 20};
};

constexpr int kTriesPerPoint = 1000;
constexpr double kClearance_m = 0.1;

struct MeasuredRoom {
  std::string name;
  std::vector<glm::dvec3> points;
};

glm::dvec3 to_point(const Json& j) { return {j.at(0).get<double>(), j.at(1).get<double>(), j.at(2).get<double>()}; }

/// At random in the air of one of the bake's rooms where the volume has light; fewer where it has little.
std::vector<glm::dvec3> points_of_room(const RayScene& rays, const LightFieldSampler& sampler, const Json& claimed,
                                       int number, int count) {
  const Json& room = claimed["rooms"][static_cast<std::size_t>(number)];
  const glm::dvec3 low = to_point(room["low_m"]), high = to_point(room["high_m"]);
  constexpr auto kReach = static_cast<float>(kClearance_m);
  Chance chance(1);
  std::vector<glm::dvec3> points;
  std::array<std::uint32_t, 8> probe;
  std::array<float, 8> weight;
  for (int i = 0; i < kTriesPerPoint * count && std::ssize(points) < count; ++i) {
    const double x = chance.between(0, 1), y = chance.between(0, 1), z = chance.between(0, 1);
    const glm::dvec3 p = low + (high - low) * glm::dvec3(x, y, z);
    if (room_of(claimed, p) == number && sampler.weights(p, probe, weight) > 0 &&
        rays.distance(rays.to_local(p), kReach) >= kReach)
      points.push_back(p);
  }
  return points;
}

/// Of a volume of given points, some of these; else in each of the rooms that the bake named.
Result<std::vector<MeasuredRoom>> measured_rooms(const BasisVolume& volume, const Json& claimed, int count) {
  std::vector<MeasuredRoom> rooms;
  if (!volume.probes.is_grid) {
    rooms.push_back({"given points", {}});
    const std::size_t step = std::max<std::size_t>(1, volume.probes.size() / static_cast<std::size_t>(count));
    for (std::size_t i = 0; i < volume.probes.size(); i += step)
      if (volume.probes.valid[i])
        rooms[0].points.push_back(volume.probes.origin + glm::dvec3(volume.probes.positions[i]));
    return rooms;
  }
  Room closed = volume.room; // no point stands within 10 cm of a pane either
  for (Material& m : closed.materials)
    m.is_window = false;
  const auto rays = RayScene::build(closed);
  if (!rays)
    return rays.error();
  const auto sampler = LightFieldSampler::make(volume);
  if (!sampler)
    return sampler.error();
  for (int i = 0; i < static_cast<int>(claimed.value("rooms", Json::array()).size()); ++i)
    if (auto points = points_of_room(*rays, *sampler, claimed, i, count); !points.empty())
      rooms.push_back({fmt::format("room {}", i + 1), std::move(points)});
  if (rooms.empty())
    return Error{ErrorCode::not_found, "the volume's report names no room", "VOLUME",
                 "bake it with --max-error: then it is measured room by room"};
  return rooms;
}

void print_room(const Json& row) {
  const auto percent = [&](const char* key) { return 100 * row[key].get<double>(); };
  fmt::print("{:<14} {:6d} {:9.2f} {:9.2f} {:9.2f} {:9.2f} {:9.2f}\n", row["place"].get<std::string>(),
             row["points"].size(), percent("smooth_claimed"), percent("smooth"), percent("sun_claimed"),
             percent("sun_looking_in"), percent("noise"));
}

Result<Json> measure(const Arguments& a, const BasisVolume& volume, const Progress& progress) {
  const Json report = Json::parse(volume.provenance.report_json, nullptr, false);
  const Json claimed = report.is_object() ? report.value("measured", Json::object()) : Json::object();
  const auto rooms = measured_rooms(volume, claimed, a.points);
  if (!rooms)
    return rooms.error();
  std::vector<TruthPoints> points;
  for (const MeasuredRoom& room : *rooms)
    points.push_back({room.points});
  const RoomFile file{volume.room, {}, volume.provenance.room_hash};
  const auto truth = room_truth(file, points, a.settings, a.truth, progress);
  if (!truth)
    return truth.error();
  const auto scene = rays_of_light(volume);
  if (!scene)
    return scene.error();
  const auto lights = lights_under(*truth, volume, *scene);
  if (!lights)
    return lights.error();
  Json rows = Json::array();
  std::size_t first = 0;
  for (const MeasuredRoom& room : *rooms) {
    Json row = place_error(room.points, first, *truth, *lights, claimed);
    row["place"] = room.name;
    for (const glm::dvec3& p : room.points)
      row["points"].push_back({p.x, p.y, p.z});
    first += room.points.size();
    rows.push_back(std::move(row));
  }
  return rows;
}

Result<void> run(const Arguments& a, const CommonOptions& options) {
  const auto volume = read_volume(a.volume);
  if (!volume)
    return volume.error();
  ProgressLine progress(options.quiet);
  const auto rooms = measure(a, *volume, progress.callback());
  progress.clear();
  if (!rooms)
    return rooms.error();
  if (!options.json) {
    fmt::print("nrms of the indirect irradiance, %    smooth skies         suns, 95th percentile\n"
               "room           points   claimed  measured   claimed  measured     noise\n");
    for (const Json& row : *rooms)
      print_room(row);
  }
  return deliver({{"machine", machine()}, {"rooms", *rooms}}, options);
}

} // namespace

Command add_volume(CLI::App& program) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* parser =
      program.add_subcommand("volume", "a baked volume beside path tracing of its room: is what it claims true?");
  parser->add_option("VOLUME", arguments->volume, "written by daylit-precompute")->required()->check(CLI::ExistingFile);
  parser->add_option("--points", arguments->points, "in each room, at random, 10 cm and more off surfaces and panes")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  parser->add_option("--samples", arguments->settings.samples, "paths per point and axis, each sky")
      ->check(CLI::Range(kBatches, 1 << 22))
      ->capture_default_str();
  parser->add_option("--suns", arguments->settings.suns, "skies with the sun somewhere, beside four others")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  parser->add_option("--keep", arguments->truth, "file that the path traced light is kept in, and taken from again");
  return {parser, [arguments](const CommonOptions& options) { return run(*arguments, options); }};
}

} // namespace daylit::bench
