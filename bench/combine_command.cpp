// daylit-bench combine: time of combining a volume beside a plain read of the same bytes, on one core, and the error
// of half floats.

#include <cmath>
#include <cstdio>
#include <memory>
#include <random>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "bench/command.h"
#include "bench/timing.h"
#include "scene/detail/tile_kernels.h"
#include "scene/volume_combiner.h"

namespace daylit::bench {
namespace {

struct Arguments {
  std::vector<int> regions = {64, 290, 1154};
  std::vector<int> grids = {8, 16, 24};
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

double largest_error(const LightField& a, const LightField& b) {
  double error = 0, most = 0;
  for (std::size_t p = 0; p < a.probe.size(); ++p)
    for (std::size_t l = 0; l < 9; ++l)
      for (int c = 0; c < 3; ++c) {
        error = std::max(error, std::abs(double(a.probe[p][l][c]) - double(b.probe[p][l][c])));
        most = std::max(most, std::abs(double(a.probe[p][l][c])));
      }
  return error / most;
}

/// The 64 probes around an object in the middle of the grid.
std::vector<std::uint32_t> object_probes(int grid) {
  std::vector<std::uint32_t> probes;
  const int first = grid / 2 - 2;
  for (int z = 0; z < 4; ++z)
    for (int y = 0; y < 4; ++y)
      for (int x = 0; x < 4; ++x)
        probes.push_back(static_cast<std::uint32_t>(first + x + grid * (first + y + grid * (first + z))));
  return probes;
}

nlohmann::json measure(int regions, int grid) {
  const BasisVolume volume = random_volume(regions, grid);
  const std::vector<Rgb> a = random_sky(regions, 1), b = random_sky(regions, 2);
  std::vector<Rgb> few = b;
  const int changed = std::max(1, regions / 16);
  for (int k = 0; k < changed; ++k)
    few[static_cast<std::size_t>(k)] = a[static_cast<std::size_t>(k)];
  VolumeCombiner full = VolumeCombiner::make(volume),
                 half = VolumeCombiner::make(volume, VolumeCombiner::Storage::float16);
  const std::span<const std::byte> plain = std::as_bytes(std::span(volume.basis));
  const std::vector<std::uint32_t> probes = object_probes(grid);
  volatile float sink = 0;
  bool odd = false, odd_half = false, odd_few = false;
  const int repetitions = plain.size() < 100000000 ? 200 : 9;
  const auto times = alternate(
      repetitions, [&] { sink = sink + detail::tile_kernels().sum_bytes(plain.data(), plain.size()); },
      [&] { full.update((odd = !odd) ? a : b); }, [&] { half.update((odd_half = !odd_half) ? a : b); });
  const auto object = alternate(repetitions, [&] { full.combine_at(a, probes); });
  const auto object_half = alternate(repetitions, [&] { half.combine_at(a, probes); });
  full.update(b);
  const auto steps = alternate(
      repetitions, [&] { full.update((odd_few = !odd_few) ? few : b); }, [&] { full.update(odd_few ? few : b); });
  full.update(a);
  half.update(a);
  const double step_bound = 1.2 * changed / regions * times[1] + 3e-6;
  return {{"regions", regions},
          {"grid", grid},
          {"megabytes", static_cast<double>(full.bytes()) / 1e6},
          {"read_ms", 1e3 * times[0]},
          {"float32_ms", 1e3 * times[1]},
          {"float16_ms", 1e3 * times[2]},
          {"of_plain_read", times[0] / times[1]},
          {"float16_over_float32", times[2] / times[1]},
          {"float16_error_of_max", largest_error(full.field(), half.field())},
          {"object_us", 1e6 * object[0]},
          {"object_float16_us", 1e6 * object_half[0]},
          {"changed_regions", changed},
          {"step_us", 1e6 * steps[0]},
          {"step_over_bound", steps[0] / step_bound},
          {"unchanged_us", 1e6 * steps[1]}};
}

Result<void> run(const Arguments& a, const CommonOptions& options) {
  set_thread_count(1);
  nlohmann::json document = {{"machine", machine()}, {"threads", 1}};
  document["vectors"] = detail::tile_kernels().name;
  if (!options.json)
    std::printf("regions grid      MB   read ms    f32 ms  of read   f16 ms  f16/f32  f16 error  object us  step us "
                "(/bound)  unchanged us\n");
  for (const int regions : a.regions)
    for (const int grid : a.grids) {
      if (interrupted())
        return interrupted_error("combine");
      const nlohmann::json row = measure(regions, grid);
      document["rows"].push_back(row);
      const auto number = [&](const char* key) { return row[key].get<double>(); };
      if (!options.json)
        std::printf("%7d %4d %7.1f %9.4f %9.4f %7.0f %% %8.4f %8.2f %10.1e %10.1f %8.1f (%4.2f) %12.2f\n", regions,
                    grid, number("megabytes"), number("read_ms"), number("float32_ms"), 100 * number("of_plain_read"),
                    number("float16_ms"), number("float16_over_float32"), number("float16_error_of_max"),
                    number("object_us"), number("step_us"), number("step_over_bound"), number("unchanged_us"));
    }
  return deliver(document, options);
}

} // namespace

Command add_combine(CLI::App& program) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* parser =
      program.add_subcommand("combine", "combining a volume against a plain read of its bytes, one core");
  parser->add_option("--regions", arguments->regions, "numbers of sky regions")->delimiter(',')->capture_default_str();
  parser->add_option("--grids", arguments->grids, "probes per axis")
      ->delimiter(',')
      ->capture_default_str()
      ->check(CLI::Range(4, 64));
  return {parser, [arguments](const CommonOptions& options) { return run(*arguments, options); }};
}

} // namespace daylit::bench
