// daylit-bench combine: time of combining a volume beside a plain read of the same bytes, on one core, and the error
// of half floats.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <memory>
#include <random>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "bench/command.h"
#include "bench/timing.h"
#include "scene/detail/tile_kernels.h"
#include "scene/local_combiner.h"
#include "scene/volume_combiner.h"
#include "scene/volume_file.h"

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

double wall_seconds() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

/// The valid probes nearest to the middle of the grid.
std::vector<std::uint32_t> probes_in_the_middle(const ProbeSet& probes, std::size_t count) {
  std::vector<std::uint32_t> order;
  for (std::uint32_t p = 0; p < probes.size(); ++p)
    if (probes.valid[p] != 0)
      order.push_back(p);
  std::ranges::sort(order, {}, [&](std::uint32_t p) {
    const glm::vec3& x = probes.positions[p];
    return std::max({std::abs(x.x), std::abs(x.y), std::abs(x.z)});
  });
  order.resize(std::min(order.size(), count));
  return order;
}

double relative_error(const std::vector<Sh9Rgb>& some, const LightField& all, std::span<const std::uint32_t> probes) {
  double error = 0, power = 0;
  for (std::size_t i = 0; i < probes.size(); ++i)
    for (std::size_t l = 0; l < 9; ++l)
      for (int c = 0; c < 3; ++c) {
        const double t = double(all.probe[probes[i]][l][c]), d = double(some[i][l][c]) - t;
        error += d * d;
        power += t * t;
      }
  return std::sqrt(error / std::max(power, 1e-300));
}

/// A baked volume: all of it, and the probes of one object.
Result<nlohmann::json> measure_file(const std::string& path) {
  const auto volume = read_volume(path);
  if (!volume)
    return volume.error();
  if (!volume->compact)
    return Error{ErrorCode::value_invalid, "the volume has no compact basis", path, "bake it with --regions fine:N"};
  const std::vector<Rgb> a = random_sky(volume->partition.size(), 1), b = random_sky(volume->partition.size(), 2);
  VolumeCombiner combiner = VolumeCombiner::make(*volume);
  const CompactBasis& basis = *volume->compact;
  const auto first_part = std::as_bytes(std::span(basis.source_half)),
             second = std::as_bytes(std::span(basis.source_byte)), third = std::as_bytes(std::span(basis.probe_half)),
             fourth = std::as_bytes(std::span(basis.probe_byte));
  volatile float sink = 0;
  bool odd = false;
  double wall = 1e9;
  for (int r = 0; r < 200; ++r) {
    const double start = wall_seconds();
    combiner.update((odd = !odd) ? a : b);
    wall = std::min(wall, wall_seconds() - start);
  }
  set_thread_count(1);
  const auto times = alternate(
      100, [&] { combiner.update((odd = !odd) ? a : b); }, [&] { received(basis.light, basis.sources, a); },
      [&] {
        for (const auto part : {first_part, second, third, fourth})
          sink = sink + detail::tile_kernels().sum_bytes(part.data(), part.size());
      });
  nlohmann::json row = {{"volume_megabytes", double(basis.bytes()) / 1e6},
                        {"combine_ms", 1e3 * wall},
                        {"combine_one_core_ms", 1e3 * times[0]},
                        {"first_light_ms", 1e3 * times[1]},
                        {"read_ms", 1e3 * times[2]}};
  combiner.update(a);
  for (const std::size_t count : {8, 64}) {
    const std::vector<std::uint32_t> probes = probes_in_the_middle(volume->probes, count);
    const double start = thread_seconds();
    const auto local = LocalCombiner::make(*volume, probes);
    const double made = thread_seconds() - start;
    if (!local)
      return local.error();
    std::vector<Sh9Rgb> field(probes.size());
    const auto object = alternate(
        500, [&] { local->combine((odd = !odd) ? a : b, field); }, [&] { combiner.combine_at(a, probes); });
    local->combine(a, field);
    row["objects"].push_back({{"probes", probes.size()},
                              {"rank", local->rank()},
                              {"kilobytes", double(local->bytes()) / 1e3},
                              {"move_ms", 1e3 * made},
                              {"frame_us", 1e6 * object[0]},
                              {"without_us", 1e6 * object[1]},
                              {"error", relative_error(field, combiner.field(), probes)}});
  }
  return row;
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
    for (const auto& o : (*row)["objects"])
      std::printf(
          "%2d probes: %.1f us per sky at rank %d (%.0f kB), %.1f ms after a move; %.0f us without; error %.2f %%\n",
          o["probes"].get<int>(), o["frame_us"].get<double>(), o["rank"].get<int>(), o["kilobytes"].get<double>(),
          o["move_ms"].get<double>(), o["without_us"].get<double>(), 100 * o["error"].get<double>());
  }
  return deliver({{"machine", machine()}, {"rows", {*row}}}, options);
}

Result<void> run(const Arguments& a, const CommonOptions& options) {
  if (!a.volume.empty())
    return run_file(a, options);
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
  parser->add_option("--volume", arguments->volume, "a baked volume with a fine sky instead");
  parser->add_option("--grids", arguments->grids, "probes per axis")
      ->delimiter(',')
      ->capture_default_str()
      ->check(CLI::Range(4, 64));
  return {parser, [arguments](const CommonOptions& options) { return run(*arguments, options); }};
}

} // namespace daylit::bench
