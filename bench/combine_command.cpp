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
#include "scene/core/tile_kernels.h"
#include "scene/volume/local_combiner.h"
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

/// Full, partial and no updates of one storage, and a plain read of the bytes of a full one, in turn.
nlohmann::json measure(const BasisVolume& volume, VolumeCombiner& combiner, std::span<const std::uint32_t> probes) {
  const int regions = volume.partition.size(), changed = std::max(1, regions / 16);
  const std::vector<Rgb> a = random_sky(regions, 1), b = random_sky(regions, 2);
  std::vector<Rgb> few = b;
  std::copy_n(a.begin(), changed, few.begin());
  const std::span<const std::byte> plain = combiner.tiles();
  const int repetitions = plain.size() < 100000000 ? 300 : 9;
  volatile float sink = 0;
  bool odd = false;
  const auto times = alternate(
      repetitions, [&] { sink = sink + detail::tile_kernels().sum_bytes(plain.data(), plain.size()); },
      [&] { combiner.update((odd = !odd) ? a : b); });
  const auto object = alternate(repetitions, [&] { combiner.combine_at(a, probes); });
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
  const double step = steps[0] / kTogether, unchanged = steps[1] / kTogether;
  combiner.update(a);
  return {{"megabytes", static_cast<double>(plain.size()) / 1e6},
          {"read_ms", 1e3 * times[0]},
          {"full_ms", 1e3 * times[1]},
          {"of_plain_read", times[0] / times[1]},
          {"object_us", 1e6 * object[0]},
          {"changed_regions", changed},
          {"step_us", 1e6 * step},
          {"step_over_bound", step / (1.2 * changed / regions * times[1] + 3e-6)},
          {"unchanged_us", 1e6 * unchanged}};
}

nlohmann::json measure(int regions, int grid) {
  const BasisVolume volume = random_volume(regions, grid);
  const std::vector<std::uint32_t> probes = object_probes(grid);
  nlohmann::json row = {{"regions", regions}, {"grid", grid}};
  VolumeCombiner full = VolumeCombiner::make(volume, VolumeCombiner::Storage::float32);
  row["float32"] = measure(volume, full, probes);
  VolumeCombiner fixed = VolumeCombiner::make(volume, VolumeCombiner::Storage::fixed16);
  row["fixed16"] = measure(volume, fixed, probes);
  row["fixed16_over_float32"] = row["fixed16"]["full_ms"].get<double>() / row["float32"]["full_ms"].get<double>();
  row["fixed16_error_of_max"] = largest_error(full.field(), fixed.field());
  return row;
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

/// Sums of squares: of the difference, and of the field.
std::pair<double, double> error_and_power(const std::vector<Sh9Rgb>& some, const LightField& all,
                                          std::span<const std::uint32_t> probes) {
  double error = 0, power = 0;
  for (std::size_t i = 0; i < probes.size(); ++i)
    for (std::size_t l = 0; l < 9; ++l)
      for (int c = 0; c < 3; ++c) {
        const double t = double(all.probe[probes[i]][l][c]), d = double(some[i][l][c]) - t;
        error += d * d;
        power += t * t;
      }
  return {error, power};
}

/// Error of the local field when one region alone is lit, over some regions of which each lights the probes.
double error_of_one_region(const LocalCombiner& local, const BasisVolume& volume,
                           std::span<const std::uint32_t> probes) {
  constexpr int kRegions = 200, kStep = 7919;
  const auto regions = static_cast<std::size_t>(volume.partition.size());
  std::vector<Sh9Rgb> some(probes.size());
  double error = 0, power = 0;
  for (std::size_t k = 0; k < kRegions; ++k) {
    std::vector<Rgb> sky(regions, Rgb(0.0f));
    sky[k * kStep % regions] = Rgb(1000.0f);
    local.combine(sky, some);
    const LightField all = combine(volume, sky);
    const auto [e, p] = error_and_power(some, all, probes);
    error += e;
    power += p;
  }
  return std::sqrt(error / std::max(power, 1e-300));
}

/// The probes around an object, small or large.
Result<nlohmann::json> measure_objects(const BasisVolume& volume, VolumeCombiner& combiner, const std::vector<Rgb>& a,
                                       const std::vector<Rgb>& b) {
  nlohmann::json rows;
  const double begin = thread_seconds();
  const auto sky = LocalSky::make(volume);
  if (!sky)
    return sky.error();
  rows["local_sky_ms"] = 1e3 * (thread_seconds() - begin);
  combiner.update(a);
  bool odd = false;
  for (const std::size_t count : {8, 64}) {
    const std::vector<std::uint32_t> probes = probes_in_the_middle(volume.probes, count);
    const auto local = LocalCombiner::make(*sky, probes);
    if (!local)
      return local.error();
    const auto move = alternate(5, [&] { (void)LocalCombiner::make(*sky, probes); });
    std::vector<Sh9Rgb> field(probes.size());
    const auto object = alternate(
        500, [&] { local->combine((odd = !odd) ? a : b, field); }, [&] { combiner.combine_at(a, probes); });
    local->combine(a, field);
    const auto [error, power] = error_and_power(field, combiner.field(), probes);
    rows["objects"].push_back({{"probes", probes.size()},
                               {"rank", local->rank()},
                               {"kilobytes", double(local->bytes()) / 1e3},
                               {"move_ms", 1e3 * move[0]},
                               {"frame_us", 1e6 * object[0]},
                               {"without_us", 1e6 * object[1]},
                               {"error", std::sqrt(error / power)},
                               {"error_of_one_region", error_of_one_region(*local, volume, probes)}});
  }
  return rows;
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
  const CompactFactors& basis = volume->compact->nine;
  const auto sources = std::as_bytes(std::span(basis.source_factor)),
             probes = std::as_bytes(std::span(basis.probe_factor));
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
      100, [&] { combiner.update((odd = !odd) ? a : b); },
      [&] { received(volume->compact->light, volume->compact->sources, a); },
      [&] {
        for (const auto part : {sources, probes})
          sink = sink + detail::tile_kernels().sum_bytes(part.data(), part.size());
      });
  nlohmann::json row = {{"volume_megabytes", double(basis.bytes()) / 1e6},
                        {"combine_ms", 1e3 * wall},
                        {"combine_one_core_ms", 1e3 * times[0]},
                        {"first_light_ms", 1e3 * times[1]},
                        {"read_ms", 1e3 * times[2]}};
  combiner.update(a);
  const auto objects = measure_objects(*volume, combiner, a, b);
  if (!objects)
    return objects.error();
  row.update(*objects);
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
      std::printf("%2d probes: %.1f us per sky at rank %d (%.0f kB), %.1f ms after a move; %.0f us without; error %.2f "
                  "%%, of one "
                  "region %.2f %%\n",
                  o["probes"].get<int>(), o["frame_us"].get<double>(), o["rank"].get<int>(),
                  o["kilobytes"].get<double>(), o["move_ms"].get<double>(), o["without_us"].get<double>(),
                  100 * o["error"].get<double>(), 100 * o["error_of_one_region"].get<double>());
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
    std::printf(
        "regions grid storage      MB   read ms   full ms  of read  object us  step us (/bound)  unchanged us\n");
  for (const int regions : a.regions)
    for (const int grid : a.grids) {
      if (interrupted())
        return interrupted_error("combine");
      const nlohmann::json row = measure(regions, grid);
      document["rows"].push_back(row);
      for (const char* storage : {"float32", "fixed16"}) {
        const auto number = [&](const char* key) { return row[storage][key].get<double>(); };
        if (!options.json)
          std::printf("%7d %4d %s %7.1f %9.4f %9.4f %6.0f %% %10.1f %8.1f (%4.2f) %12.2f\n", regions, grid, storage,
                      number("megabytes"), number("read_ms"), number("full_ms"), 100 * number("of_plain_read"),
                      number("object_us"), number("step_us"), number("step_over_bound"), number("unchanged_us"));
      }
      if (!options.json)
        std::printf("             fixed16 takes %.2f of the time of float32, error %.1e of the largest coefficient\n",
                    row["fixed16_over_float32"].get<double>(), row["fixed16_error_of_max"].get<double>());
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
