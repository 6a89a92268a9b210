// daylit-bench error-vs-time: rooms baked to errors. For each room, target and sky the measured error beside the time
// of the bake, the size of the file and the time to combine it; what the plan predicted beside what came out.

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <memory>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "bench/bench_rooms.h"
#include "bench/command.h"
#include "bench/timing.h"
#include "precompute/planned_bake.h"
#include "scene/volume_combiner.h"

namespace daylit::bench {
namespace {

struct Arguments {
  std::vector<std::string> rooms = {"cornell", "office", "l_shape"};
  std::vector<double> targets = {4, 2, 1};
  bool append = false;
};

double clock_seconds(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

struct NamedRoom {
  std::string name;
  RoomFile file;
};

Result<NamedRoom> find_room(const std::string& name) {
  auto generated = bench_rooms();
  if (!generated)
    return generated.error();
  for (BenchRoom& r : *generated)
    if (r.name == name)
      return NamedRoom{name, std::move(r.file)};
  auto file = read_room(name);
  if (!file)
    return file.error();
  return NamedRoom{std::filesystem::path(name).stem().string(), std::move(*file)};
}

Result<double> file_bytes(const precompute::PlannedBake& bake) {
  const auto path = std::filesystem::temp_directory_path() / ("daylit-bench-" + std::to_string(::getpid()) + ".volume");
  if (const Result<void> written = write_volume(path, bake.volume, bake.plan.precision); !written)
    return written.error();
  const auto bytes = static_cast<double>(std::filesystem::file_size(path));
  std::filesystem::remove(path);
  return bytes;
}

/// One thread, the whole volume, all radiances changed each time.
double combine_ms(const BasisVolume& volume) {
  VolumeCombiner combiner = VolumeCombiner::make(volume, VolumeCombiner::Storage::float16);
  const std::vector<Rgb> bright(static_cast<std::size_t>(volume.partition.size()), Rgb(1.0f)),
      dim(bright.size(), Rgb(0.5f));
  bool odd = false;
  set_thread_count(1);
  const double seconds = alternate(20, [&] { combiner.update((odd = !odd) ? bright : dim); })[0];
  set_thread_count(0);
  return 1e3 * seconds;
}

Result<nlohmann::json> measure(const NamedRoom& room, double target_percent, const Progress& progress) {
  precompute::PlanRequest request;
  request.max_error = 0.01 * target_percent;
  const double wall = clock_seconds(CLOCK_MONOTONIC), cpu = clock_seconds(CLOCK_PROCESS_CPUTIME_ID);
  const auto baked = precompute::bake_to_error(room.file, request, nullptr, progress, [](const std::string&) {});
  if (!baked)
    return baked.error();
  nlohmann::json row = {{"room", room.name},
                        {"target", request.max_error},
                        {"wall_seconds", clock_seconds(CLOCK_MONOTONIC) - wall},
                        {"cpu_seconds", clock_seconds(CLOCK_PROCESS_CPUTIME_ID) - cpu}};
  const auto bytes = file_bytes(*baked);
  if (!bytes)
    return bytes.error();
  row["file_bytes"] = *bytes;
  row["combine_ms"] = combine_ms(baked->volume);
  const auto text = nlohmann::json::parse(to_json(*baked));
  for (const char* key : {"plan", "predicted", "measured"})
    row[key] = text[key];
  row["patches"] = baked->report.patches;
  row["probes"] = baked->report.probes_valid;
  for (const precompute::SkyError& s : baked->report.audit.sky)
    row["skies"].push_back({{"sky", s.sky},
                            {"error", std::hypot(s.total, baked->measured.mesh)},
                            {"irradiance", std::hypot(s.irradiance, baked->measured.mesh)}});
  return row;
}

void print_row(const nlohmann::json& row) {
  const auto percent = [&](const char* part, const char* key) { return 100 * row[part][key].get<double>(); };
  std::printf("%-20s %5.2f %9.2f %8.2f %7.1f %7.1f %7d %7d %-10s %7.1f %7.1f %7.1f %8.3f\n",
              row["room"].get<std::string>().c_str(), 100 * row["target"].get<double>(), percent("predicted", "error"),
              percent("measured", "error"), percent("predicted", "sun"), percent("measured", "sun"),
              row["patches"].get<int>(), row["probes"].get<int>(), row["plan"]["regions"].get<std::string>().c_str(),
              row["predicted"]["seconds"].get<double>(), row["wall_seconds"].get<double>(),
              1e-6 * row["file_bytes"].get<double>(), row["combine_ms"].get<double>());
}

Result<void> run(const Arguments& a, const CommonOptions& options) {
  nlohmann::json document = {{"machine", machine()}, {"rows", nlohmann::json::array()}};
  document["machine"]["clock"] = "wall clock and process CPU time of the bake, pilot included; combine: one thread";
  if (a.append && !options.output.empty())
    if (std::ifstream before(options.output); before)
      document["rows"] = nlohmann::json::parse(before)["rows"];
  if (!options.json)
    std::printf("room                 asked predicted measured  sun: pr. meas.  patches  probes sky         s: pr.  "
                "  meas.      MB combine ms\n");
  for (const std::string& name : a.rooms) {
    const auto room = find_room(name);
    if (!room)
      return room.error();
    for (const double target : a.targets) {
      ProgressLine progress(options.quiet);
      const auto row = measure(*room, target, progress.callback());
      progress.clear();
      if (!row)
        return row.error();
      document["rows"].push_back(*row);
      if (!options.json)
        print_row(*row);
      std::fflush(stdout);
    }
  }
  return deliver(document, options);
}

} // namespace

Command add_error_vs_time(CLI::App& program) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* parser = program.add_subcommand("error-vs-time", "rooms baked to errors: error, time, size, combine time");
  parser->add_option("--rooms", arguments->rooms, "cornell, office, l_shape, or room models")
      ->delimiter(',')
      ->capture_default_str();
  parser->add_option("--targets", arguments->targets, "errors to ask for, per cent")
      ->delimiter(',')
      ->capture_default_str();
  parser->add_flag("--append", arguments->append, "keep the rows that the output file holds");
  return {parser, [arguments](const CommonOptions& options) { return run(*arguments, options); }};
}

} // namespace daylit::bench
