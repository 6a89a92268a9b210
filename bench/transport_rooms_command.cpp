// daylit-bench transport-rooms: energy balance and row closure of the bake in every room of the suite: the generated
// ones, those that break renderers, and any file that is named.

#include <cstdio>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "bench/bench_rooms.h"
#include "bench/command.h"
#include "bench/stress_rooms.h"
#include "precompute/room_frame.h"

namespace daylit::bench {
namespace {

constexpr double kMostImbalance = 1e-4;

struct Arguments {
  std::vector<std::string> rooms;
  std::string quality = "normal";
  int facets = 0;
};

struct NamedRoom {
  std::string name;
  RoomFile file;
};

Result<std::vector<NamedRoom>> all_rooms(const Arguments& a) {
  std::vector<NamedRoom> rooms;
  for (const std::string& path : a.rooms) {
    auto file = read_room(path);
    if (!file)
      return file.error();
    rooms.push_back({std::filesystem::path(path).stem().string(), std::move(*file)});
  }
  auto generated = bench_rooms();
  if (!generated)
    return generated.error();
  for (BenchRoom& room : *generated)
    rooms.push_back({room.name, std::move(room.file)});
  for (StressRoom& room : stress_rooms())
    rooms.push_back({room.name, {std::move(room.room), {}, ""}});
  return rooms;
}

Result<nlohmann::json> measure(const NamedRoom& room, const Arguments& a, const CommonOptions& common) {
  auto options = precompute::quality_options(a.quality);
  if (!options)
    return options.error();
  if (a.facets > 0)
    options->target_facets = a.facets;
  options->grid = glm::ivec3(4);
  precompute::BakeReport r;
  ProgressLine progress(common.quiet);
  const auto volume = precompute::bake_room(room.file, *SkyPartition::uniform(64), *options, progress.callback(), r);
  progress.clear();
  if (!volume)
    return volume.error();
  nlohmann::json row = {{"room", room.name},
                        {"facets", r.facets},
                        {"patches", r.patches},
                        {"worst_closure", r.closure.worst},
                        {"mean_closure", r.closure.mean},
                        {"rows_left_open", r.closure.left},
                        {"imbalance", r.energy.imbalance},
                        {"imbalance_unclosed", r.energy.unclosed},
                        {"iterations", r.solve.iterations},
                        {"worst_residual", r.solve.worst_residual},
                        {"wall_seconds", r.total_seconds},
                        {"passed", r.energy.imbalance <= kMostImbalance}};
  for (const precompute::StageTime& s : r.stages)
    row["wall_of_stage"][s.name] = s.seconds;
  return row;
}

void print_row(const nlohmann::json& row) {
  std::printf("%-44s %7d %8d %8.1e %9.1e %5d %10.1e %10.1e %6.2f%s\n", row["room"].get<std::string>().c_str(),
              row["facets"].get<int>(), row["patches"].get<int>(), row["worst_closure"].get<double>(),
              row["mean_closure"].get<double>(), row["rows_left_open"].get<int>(),
              row["imbalance_unclosed"].get<double>(), row["imbalance"].get<double>(),
              row["wall_seconds"].get<double>(), row["passed"].get<bool>() ? "" : "  OUTSIDE");
}

Result<void> run(const Arguments& a, const CommonOptions& options) {
  const auto rooms = all_rooms(a);
  if (!rooms)
    return rooms.error();
  nlohmann::json document = {
      {"machine", machine()}, {"quality", a.quality}, {"regions", 64}, {"bar", kMostImbalance}, {"passed", true}};
  if (!options.json)
    std::printf("%-44s facets patches  closure      mean  left  imbalance  rows closed  wall s\n", "room");
  for (const NamedRoom& room : *rooms) {
    const auto row = measure(room, a, options);
    if (!row)
      return row.error();
    document["passed"] = document["passed"].get<bool>() && (*row)["passed"].get<bool>();
    document["rows"].push_back(*row);
    if (!options.json)
      print_row(*row);
  }
  if (const Result<void> delivered = deliver(document, options); !delivered)
    return delivered;
  if (!document["passed"].get<bool>())
    return Error{ErrorCode::value_invalid, "the energy of a room does not balance to 1e-4", "transport-rooms", ""};
  return {};
}

} // namespace

Command add_transport_rooms(CLI::App& program) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* parser = program.add_subcommand("transport-rooms", "energy balance and row closure, room by room");
  parser->add_option("rooms", arguments->rooms, "room files beside the generated rooms")->check(CLI::ExistingFile);
  parser->add_option("--quality", arguments->quality, "draft, normal or high")->capture_default_str();
  parser->add_option("--patches", arguments->facets, "about this many facets (0: as the quality asks)")
      ->capture_default_str();
  return {parser, [arguments](const CommonOptions& options) { return run(*arguments, options); }};
}

} // namespace daylit::bench
