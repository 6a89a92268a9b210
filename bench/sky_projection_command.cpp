// daylit-bench sky-projection: time from a fish-eye picture of the sky to radiances of regions or nodes, beside a plain
// sweep of the picture's bytes, with caches flushed and warm, on one core.

#include <cstdio>
#include <memory>
#include <random>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "bench/command.h"
#include "bench/plain_read.h"
#include "bench/timing.h"
#include "scene/sky/sky_partition.h"
#include "scene/volume/volume_file.h"

namespace daylit::bench {
namespace {

struct Arguments {
  std::vector<int> nodes = {64, 1024, 16384};
  int size_px = 1024;
  std::vector<std::string> volumes;
};

constexpr int kRepetitions = 40;
constexpr double kField = 3.14159265358979; ///< of view

SkyImage noisy_sky(int size_px) {
  RgbImage image(size_px, size_px);
  std::mt19937 random(1);
  std::uniform_real_distribution<float> unit(0.0f, 1.0f);
  for (Rgb& t : image.texels)
    t = {unit(random), unit(random), unit(random)};
  FisheyeProjection projection;
  projection.lens = ideal_fisheye(size_px, size_px, kField);
  return *SkyImage::make(std::move(image), projection, {GroundFill::Kind::albedo, 0.2f});
}

/// Writes twice what the last cache holds.
void flush_caches() {
  constexpr std::size_t kLeast = std::size_t{256} << 20, kLine = 64;
  static std::vector<std::byte> other(std::max(kLeast, 2 * std::size_t(std::max(sysconf(_SC_LEVEL3_CACHE_SIZE), 0L))));
  for (std::size_t k = 0; k < other.size(); k += kLine)
    other[k] = static_cast<std::byte>(std::to_integer<int>(other[k]) + 1);
}

nlohmann::json measure(const SkyImage& sky, const SkyPartition& partition, std::span<const std::uint8_t> needed = {}) {
  const RegionSums sums = RegionSums::make(sky.geometry(), partition, needed);
  const std::span<const std::byte> picture = std::as_bytes(std::span(sky.image().texels));
  volatile float sink = 0;
  const auto sweep = [&] { read_plainly(picture); };
  const auto reduce = [&] { sink = sink + sums.reduce(sky).front().r; };
  const auto warm_sweep = alternate(kRepetitions, sweep), warm = alternate(kRepetitions, reduce);
  std::vector<double> cold_sweeps, colds;
  for (int k = 0; k < kRepetitions / 4; ++k) {
    flush_caches();
    cold_sweeps.push_back(time_once(sweep));
    flush_caches();
    colds.push_back(time_once(reduce));
  }
  const double cold_sweep = median(cold_sweeps), cold = median(colds);
  return {{"name", partition.name()},
          {"table_megabytes", static_cast<double>(sums.bytes()) / 1e6},
          {"sweep_warm_ms", 1e3 * warm_sweep[0]},
          {"warm_ms", 1e3 * warm[0]},
          {"warm_over_sweep", warm[0] / warm_sweep[0]},
          {"sweep_cold_ms", 1e3 * cold_sweep},
          {"cold_ms", 1e3 * cold},
          {"cold_over_sweep", cold / cold_sweep}};
}

Result<void> run(const Arguments& a, const CommonOptions& options) {
  set_thread_count(1);
  const SkyImage sky = noisy_sky(a.size_px);
  nlohmann::json document = {{"machine", machine()}, {"threads", 1}, {"pixels", a.size_px * a.size_px}};
  document["picture_megabytes"] = static_cast<double>(sky.image().texels.size() * sizeof(Rgb)) / 1e6;
  if (!options.json)
    std::printf("partition        table MB   warm: sweep ms  reduced ms  ratio   cold: sweep ms  reduced ms  ratio\n");
  const auto add = [&](const nlohmann::json& row) {
    document["rows"].push_back(row);
    const auto number = [&](const char* key) { return row[key].get<double>(); };
    if (!options.json)
      std::printf("%-16s %8.2f %16.3f %11.3f %6.2f %16.3f %11.3f %6.2f\n", row["name"].get<std::string>().c_str(),
                  number("table_megabytes"), number("sweep_warm_ms"), number("warm_ms"), number("warm_over_sweep"),
                  number("sweep_cold_ms"), number("cold_ms"), number("cold_over_sweep"));
  };
  for (const int nodes : a.nodes)
    for (const bool interpolated : {false, true}) {
      if (interrupted())
        return interrupted_error("sky-projection");
      const auto partition = interpolated ? SkyPartition::fine(nodes) : SkyPartition::uniform(nodes);
      if (partition) // else more regions than constants may have
        add(measure(sky, *partition));
    }
  for (const std::string& file : a.volumes) {
    const auto volume = read_volume(file);
    if (!volume)
      return volume.error();
    const std::vector<std::uint8_t> needed = regions_that_count(*volume);
    nlohmann::json row = measure(sky, volume->partition, needed);
    row["name"] = "a room's " + std::to_string(std::ranges::count(needed, std::uint8_t{1})) + " of " +
                  std::to_string(needed.size());
    add(row);
  }
  return deliver(document, options);
}

} // namespace

Command add_sky_projection(CLI::App& program) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* parser =
      program.add_subcommand("sky-projection", "a fish-eye picture to sky regions against a plain sweep, one core");
  parser->add_option("--nodes", arguments->nodes, "numbers of regions")->delimiter(',')->capture_default_str();
  parser->add_option("--size", arguments->size_px, "of the square picture, pixels")
      ->capture_default_str()
      ->check(CLI::Range(64, 8192));
  parser->add_option("--volume", arguments->volumes, "also the regions that count in the room of this volume");
  return {parser, [arguments](const CommonOptions& options) { return run(*arguments, options); }};
}

} // namespace daylit::bench
