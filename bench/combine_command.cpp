// daylit-bench combine: time of combining a volume beside a plain read of the same bytes, on one core.

#include <algorithm>
#include <cstdio>
#include <memory>
#include <random>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "bench/command.h"
#include "bench/plain_read.h"
#include "bench/timing.h"
#include "scene/volume/volume_combiner.h"
#include "scene/volume/volume_file.h"

namespace daylit::bench {
namespace {

struct Arguments {
  std::vector<int> regions = {64, 290, 1154};
  std::vector<int> grids = {8, 16, 24};
  std::string volume; ///< not empty: this one instead
};

std::vector<Rgb> random_sky(int regions, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> ten(0.1f, 10.0f);
  std::vector<Rgb> sky(static_cast<std::size_t>(regions));
  for (Rgb& c : sky)
    c = {ten(random), ten(random), ten(random)};
  return sky;
}

/// Numbers of the size and spread of a baked volume; what they are does not change the time.
BasisVolume random_volume(int regions, int grid) {
  BasisVolume v;
  v.partition = *SkyPartition::uniform(regions);
  v.probes.positions.resize(static_cast<std::size_t>(grid) * grid * grid);
  v.probes.valid.assign(v.probes.size(), 1);
  for (int r = 0; r < regions; ++r)
    v.stored_region.push_back(r);
  v.basis.resize(static_cast<std::size_t>(regions) * v.row_floats());
  std::uint32_t state = 1;
  for (float& x : v.basis) {
    state = state * 1664525u + 1013904223u;
    x = static_cast<float>(state >> 8) * 0x1p-24f - 0.3f;
  }
  return v;
}

/// Full, partial and no updates, and a plain read of the bytes of a full one, in turn.
nlohmann::json measure(int regions, int grid) {
  const BasisVolume volume = random_volume(regions, grid);
  VolumeCombiner combiner = VolumeCombiner::make(volume);
  const int changed = std::max(1, regions / 16);
  const std::vector<Rgb> a = random_sky(regions, 1), b = random_sky(regions, 2);
  std::vector<Rgb> few = b;
  std::copy_n(a.begin(), changed, few.begin());
  const auto plain = std::as_bytes(std::span(volume.basis));
  const int repetitions = plain.size() < 100000000 ? 300 : 9;
  bool odd = false;
  const auto times = alternate(
      repetitions, [&] { read_plainly(plain); }, [&] { combiner.update((odd = !odd) ? a : b); });
  combiner.update(b);
  constexpr int kTogether = 16; // reading the clock takes half a microsecond
  const auto steps = alternate(
      repetitions,
      [&] {
        for (int k = 0; k < kTogether; ++k)
          combiner.update((odd = !odd) ? few : b);
      },
      [&] {
        for (int k = 0; k < kTogether; ++k)
          combiner.update(odd ? few : b);
      });
  return {{"regions", regions},
          {"grid", grid},
          {"megabytes", static_cast<double>(plain.size()) / 1e6},
          {"read_ms", 1e3 * times[0]},
          {"full_ms", 1e3 * times[1]},
          {"changed_regions", changed},
          {"step_us", 1e6 * steps[0] / kTogether},
          {"unchanged_us", 1e6 * steps[1] / kTogether}};
}

/// A baked volume: all of it, and the light on the surfaces alone.
Result<nlohmann::json> measure_file(const std::string& path) {
  const auto volume = read_volume(path);
  if (!volume)
    return volume.error();
  if (!volume->compact)
    return Error{ErrorCode::value_invalid, "the volume has no compact basis", path, "bake it with --regions fine:N"};
  const CompactBasis& basis = *volume->compact;
  const std::vector<Rgb> a = random_sky(volume->partition.size(), 1), b = random_sky(volume->partition.size(), 2);
  VolumeCombiner combiner = VolumeCombiner::make(*volume);
  bool odd = false;
  double wall = 1e9;
  for (int r = 0; r < 200; ++r)
    wall = std::min(wall, wall_time_once([&] { combiner.update((odd = !odd) ? a : b); }));
  set_thread_count(1);
  const auto times = alternate(
      100, [&] { combiner.update((odd = !odd) ? a : b); }, [&] { irradiance_of_sources(basis.light, a); },
      [&] {
        read_plainly(std::as_bytes(std::span(basis.nine.strong.source_factor)));
        read_plainly(std::as_bytes(std::span(basis.nine.strong.probe_factor)));
        read_plainly(std::as_bytes(std::span(basis.nine.weak.source_factor)));
        read_plainly(std::as_bytes(std::span(basis.nine.weak.probe_factor)));
      });
  return nlohmann::json{{"volume_megabytes", double(basis.nine.bytes()) / 1e6},
                        {"clusters", basis.nine.cluster.size()},
                        {"strong_components", basis.nine.strong.scale.size()},
                        {"weak_components", basis.nine.weak.scale.size()},
                        {"combine_ms", 1e3 * wall},
                        {"combine_one_core_ms", 1e3 * times[0]},
                        {"first_light_ms", 1e3 * times[1]},
                        {"read_ms", 1e3 * times[2]}};
}

Result<void> run_file(const Arguments& a, const CommonOptions& options) {
  const auto row = measure_file(a.volume);
  if (!row)
    return row.error();
  if (!options.json) {
    const auto number = [&](const char* key) { return (*row)[key].get<double>(); };
    std::printf("%.1f MB, combined in %.3f ms (one core %.3f, of it the light on the surfaces %.3f; plain read %.3f)\n",
                number("volume_megabytes"), number("combine_ms"), number("combine_one_core_ms"),
                number("first_light_ms"), number("read_ms"));
  }
  return deliver({{"machine", machine()}, {"rows", {*row}}}, options);
}

Result<void> run(const Arguments& a, const CommonOptions& options) {
  if (!a.volume.empty())
    return run_file(a, options);
  set_thread_count(1);
  nlohmann::json document = {{"machine", machine()}, {"threads", 1}};
  if (!options.json)
    std::printf("regions grid      MB   read ms   full ms  changed  step us  unchanged us\n");
  for (const int regions : a.regions)
    for (const int grid : a.grids) {
      if (interrupted())
        return interrupted_error("combine");
      const nlohmann::json row = measure(regions, grid);
      document["rows"].push_back(row);
      const auto number = [&](const char* key) { return row[key].get<double>(); };
      if (!options.json)
        std::printf("%7d %4d %7.1f %9.4f %9.4f %8d %8.1f %13.2f\n", regions, grid, number("megabytes"),
                    number("read_ms"), number("full_ms"), row["changed_regions"].get<int>(), number("step_us"),
                    number("unchanged_us"));
    }
  return deliver(document, options);
}

} // namespace

Command add_combine(CLI::App& program) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* parser =
      program.add_subcommand("combine", "combining a volume against a plain read of its bytes, one core");
  parser->add_option("--regions", arguments->regions, "numbers of sky regions")->delimiter(',')->capture_default_str();
  parser->add_option("--volume", arguments->volume, "a baked volume with a fine sky instead");
  parser->add_option("--grids", arguments->grids, "probes per axis")
      ->delimiter(',')
      ->capture_default_str()
      ->check(CLI::Range(4, 64));
  return {parser, [arguments](const CommonOptions& options) { return run(*arguments, options); }};
}

} // namespace daylit::bench
