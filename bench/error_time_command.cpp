// daylit-bench error-vs-time: rooms baked to errors. For each room, target and sky the error against the path tracer
// beside the time of the bake, the size of the file and the time to combine it; what the plan predicted, and what the
// bake measured of itself, beside it.

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "bench/bench_rooms.h"
#include "bench/command.h"
#include "bench/reference_light.h"
#include "bench/timing.h"
#include "precompute/planned_bake.h"
#include "scene/volume/volume_combiner.h"

namespace daylit::bench {
namespace {

struct Arguments {
  std::vector<std::string> rooms = {"office", "l_shape"};
  std::vector<double> targets = {4, 2, 1};
  std::vector<std::filesystem::path> pictures;
  std::string regions, density = "auto";
  int points = 33, samples = 16384;
  bool append = false;
};

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
double combine_ms(const BasisVolume& volume, ShOrder order) {
  VolumeCombiner combiner = VolumeCombiner::make(volume, order);
  const auto regions = static_cast<std::size_t>(volume.partition.size());
  const std::array<std::vector<Rgb>, 2> sky{std::vector<Rgb>(regions, Rgb(1.0f)), std::vector<Rgb>(regions, Rgb(0.5f))};
  bool odd = false;
  set_thread_count(1);
  const double seconds = alternate(20, [&] { combiner.update(sky[(odd = !odd) ? 0 : 1]); })[0];
  set_thread_count(0);
  return 1e3 * seconds;
}

/// A room, the skies that shine into it and the light they make.
struct Case {
  NamedRoom room;
  std::vector<BenchSky> skies;
  std::vector<ReferenceLight> light; ///< of each sky
};

Result<Case> make_case(const Arguments& a, const std::string& name, const Progress& progress) {
  auto room = find_room(name);
  if (!room)
    return room.error();
  const auto rays = RayScene::build(room->file.room);
  if (!rays)
    return rays.error();
  const auto apertures = find_apertures(room->file.room, *rays);
  if (!apertures)
    return apertures.error();
  auto skies = bench_skies(apertures->list, a.pictures);
  if (!skies)
    return skies.error();
  const auto points = reference_points(room->file.room, apertures->list, static_cast<std::size_t>(a.points));
  if (!points)
    return points.error();
  std::vector<ReferenceLight> light;
  for (const BenchSky& sky : *skies) {
    auto traced = trace_reference(room->file.room, apertures->list, sky, *points, a.samples, progress);
    if (!traced)
      return traced.error();
    light.push_back(std::move(*traced));
  }
  return Case{std::move(*room), std::move(*skies), std::move(light)};
}

Result<nlohmann::json> errors(const Case& c, const BasisVolume& volume) {
  nlohmann::json list = nlohmann::json::array();
  for (std::size_t s = 0; s < c.skies.size(); ++s) {
    const auto e = light_error(volume, c.skies[s], c.light[s]);
    if (!e)
      return e.error();
    list.push_back({{"sky", c.skies[s].name},
                    {"small_sun", c.skies[s].small_sun},
                    {"coefficients", e->coefficients},
                    {"irradiance", e->irradiance},
                    {"reference_coefficients", e->coefficient_noise},
                    {"reference_irradiance", e->irradiance_noise},
                    {"nine_coefficients", e->nine_coefficients},
                    {"with_band4", e->with_band4}});
  }
  return list;
}

Result<nlohmann::json> measure(const Case& c, const Arguments& a, double target_percent, const Progress& progress) {
  precompute::PlanRequest request;
  request.max_error = 0.01 * target_percent;
  request.regions = a.regions;
  request.must_reach = a.regions.empty();
  if (a.density != "auto")
    request.graded = a.density == "graded";
  const double wall = wall_seconds(), cpu = process_seconds();
  const auto baked = precompute::bake_to_error(c.room.file, request, nullptr, progress, [](const std::string&) {});
  if (!baked)
    return baked.error();
  nlohmann::json row = {{"room", c.room.name},
                        {"target", request.max_error},
                        {"wall_seconds", wall_seconds() - wall},
                        {"cpu_seconds", process_seconds() - cpu}};
  const auto bytes = file_bytes(*baked);
  if (!bytes)
    return bytes.error();
  row["file_bytes"] = *bytes;
  row["combine_ms"] = combine_ms(baked->volume, ShOrder::second);
  row["combine_order4_ms"] = combine_ms(baked->volume, ShOrder::fourth);
  const auto text = nlohmann::json::parse(to_json(*baked));
  for (const char* key : {"plan", "predicted", "measured", "seconds"})
    row[key] = text[key];
  row["facets"] = baked->report.facets;
  row["probes"] = baked->report.probes_valid;
  const auto found = errors(c, baked->volume);
  if (!found)
    return found.error();
  row["skies"] = *found;
  return row;
}

void print_row(const nlohmann::json& row) {
  const auto percent = [&](const char* part, const char* key) { return 100 * row[part][key].get<double>(); };
  std::printf("%-20s %5.2f %9.2f %8.2f %7.1f %7.1f %7d %7d %-10s %7.1f %7.1f %7.1f %8.3f\n",
              row["room"].get<std::string>().c_str(), 100 * row["target"].get<double>(), percent("predicted", "error"),
              percent("measured", "error"), percent("predicted", "sun"), percent("measured", "sun"),
              row["facets"].get<int>(), row["probes"].get<int>(), row["plan"]["regions"].get<std::string>().c_str(),
              row["predicted"]["seconds"].get<double>(), row["wall_seconds"].get<double>(),
              1e-6 * row["file_bytes"].get<double>(), row["combine_ms"].get<double>());
  for (const nlohmann::json& sky : row["skies"]) {
    const auto of = [&](const char* key) { return 100 * sky[key].get<double>(); };
    std::printf("    %-32s coefficients %6.2f %% (reference %.2f)  irradiance %6.2f %% (reference %.2f, nine "
                "coefficients leave %.2f, with l = 4 %.2f)\n",
                sky["sky"].get<std::string>().c_str(), of("coefficients"), of("reference_coefficients"),
                of("irradiance"), of("reference_irradiance"), of("nine_coefficients"), of("with_band4"));
  }
}

Result<void> run(const Arguments& a, const CommonOptions& options) {
  nlohmann::json document = {{"machine", machine()}, {"rows", nlohmann::json::array()}};
  document["machine"]["clock"] =
      "wall clock and process CPU time of the bake, calibration bakes included; combine: one thread";
  document["reference"] = {{"points", a.points}, {"paths_per_point", a.samples}};
  if (a.append && !options.output.empty())
    if (std::ifstream before(options.output); before)
      document["rows"] = nlohmann::json::parse(before)["rows"];
  if (!options.json)
    std::printf("room                 asked predicted measured  sun: pr. meas.  facets  probes sky         s: pr.  "
                "  meas.      MB combine ms\n");
  for (const std::string& name : a.rooms) {
    ProgressLine progress(options.quiet);
    const auto one = make_case(a, name, progress.callback());
    if (!one)
      return one.error();
    for (const double target : a.targets) {
      const auto row = measure(*one, a, target, progress.callback());
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
  parser->add_option("--rooms", arguments->rooms, "cornell, office, l_shape, storeys, or room models")
      ->delimiter(',')
      ->capture_default_str();
  parser->add_option("--targets", arguments->targets, "errors to ask for, per cent")
      ->delimiter(',')
      ->capture_default_str();
  parser->add_option("--pictures", arguments->pictures, "equirectangular HDR pictures of skies")->delimiter(',');
  parser->add_option("--regions", arguments->regions, "of the sky, instead of the planned ones");
  parser->add_option("--density", arguments->density, "graded or regular grid of probes")
      ->check(CLI::IsMember({"auto", "graded", "regular"}));
  parser->add_option("--points", arguments->points, "where light is compared")->check(CLI::Range(1, 4096));
  parser->add_option("--samples", arguments->samples, "paths per point of the reference")
      ->check(CLI::Range(kBatches, 1 << 22));
  parser->add_flag("--append", arguments->append, "keep the rows that the output file holds");
  return {parser, [arguments](const CommonOptions& options) { return run(*arguments, options); }};
}

} // namespace daylit::bench
