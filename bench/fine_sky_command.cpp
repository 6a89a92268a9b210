// daylit-bench fine-sky: a small sun that moves in steps of 0.25 degrees, followed by a compact basis, against suns of
// exactly that area solved one by one in the same room at the same probes.

#include <cmath>
#include <cstdio>
#include <memory>
#include <numbers>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "bench/command.h"
#include "bench/timing.h"
#include "precompute/bake.h"
#include "scene/volume/volume_combiner.h"

namespace daylit::bench {
namespace {

constexpr double kPi = std::numbers::pi, kStep = 0.25 * kPi / 180;
constexpr int kSteps = 1440; ///< around the sky; a sun is two cells wide and as high

struct Arguments {
  std::string room;
  std::vector<int> nodes = {4096};
  double altitude_deg = 25, error = 0.03;
  int exact_facets = 8000, exact_rays = 16384;
};

struct SunCells {
  SkyPartition partition;
  int first = 0; ///< region of the first cell of the sun's band
};

/// One band of cells a step wide and two steps high at the sun's altitude; the rest of the sky in regions of 6 degrees,
/// because the first bounce is integrated over as many directions in each region.
Result<SunCells> sun_cells(double altitude) {
  constexpr int kBands = 15, kCells = 60;
  const double low = std::sin(altitude - kStep), high = std::sin(altitude + kStep);
  std::vector<SkyBand> bands;
  const auto add = [&](double to, int cells) {
    const int next = bands.empty() ? 0 : bands.back().first_region + bands.back().cells;
    bands.push_back({bands.empty() ? -1.0 : bands.back().sin_high, to, cells, next, false});
  };
  for (int i = 1 - kBands; i <= 0; ++i)
    add(i == 0 ? 0.0 : std::sin(0.5 * kPi * i / kBands), kCells);
  for (int i = 1; i <= kBands && std::sin(0.5 * kPi * i / kBands) < low - 1e-6; ++i)
    add(std::sin(0.5 * kPi * i / kBands), kCells);
  add(low, kCells);
  add(high, kSteps);
  const int first = bands.back().first_region;
  for (int i = 1; i <= kBands; ++i)
    if (const double to = i == kBands ? 1.0 : std::sin(0.5 * kPi * i / kBands); to > high + 1e-6)
      add(to, kCells);
  const auto partition = SkyPartition::from_bands(std::move(bands), "sun");
  if (!partition)
    return partition.error();
  return SunCells{*partition, first};
}

/// Radiance 1 of a sun over cells k and k + 1 on the nodes of a partition.
std::vector<Rgb> sun_on_nodes(const SkyPartition& nodes, const SunCells& cells, int k) {
  std::vector<Rgb> radiance(static_cast<std::size_t>(nodes.size()), Rgb(0.0f));
  constexpr int kSide = 4;
  for (int cell = 0; cell < 2; ++cell) {
    const int region = cells.first + (k + cell) % kSteps;
    for (int s = 0; s < kSide * kSide; ++s) {
      const glm::dvec3 d = cells.partition.sample(region, (s % kSide + 0.5) / kSide, (s / kSide + 0.5) / kSide);
      for (const RegionWeight& w : nodes.interpolation(d))
        radiance[static_cast<std::size_t>(w.region)] += Rgb(static_cast<float>(
            w.weight * cells.partition.solid_angle_sr(region) / (kSide * kSide) / nodes.solid_angle_sr(w.region)));
    }
  }
  return radiance;
}

/// Root of the sum of squared differences over some probes.
double distance(const LightField& a, const LightField& b, std::span<const std::size_t> probes) {
  double sum = 0;
  for (const std::size_t p : probes)
    for (std::size_t l = 0; l < 9; ++l)
      for (int c = 0; c < 3; ++c) {
        const double d = double(a.probe[p][l][c]) - double(b.probe[p][l][c]);
        sum += d * d;
      }
  return std::sqrt(sum);
}

/// The volume of the fine sky, the exact suns on the same probes, which of these are valid, and which of those do not
/// stand in the outermost layer, close to the walls.
struct Pair {
  BasisVolume volume, truth;
  SunCells cells;
  std::vector<std::size_t> valid, inner;
  precompute::CompactReport compact;
  double bake_seconds = 0;
};

bool is_inner(const ProbeSet& grid, std::size_t probe) {
  auto left = static_cast<int>(probe);
  bool inner = true;
  for (int axis = 0; axis < 3; ++axis) {
    const int place = left % grid.count[axis];
    left /= grid.count[axis];
    inner = inner && place > 0 && place + 1 < grid.count[axis];
  }
  return inner;
}

Result<Pair> bake_both(const RoomFile& room, int nodes, const Arguments& a, const Progress& progress) {
  precompute::BakeOptions options;
  options.compact_error = a.error;
  precompute::BakeReport report, truth_report;
  const auto partition = SkyPartition::fine(nodes);
  if (!partition)
    return partition.error();
  const double start = process_seconds();
  auto volume = precompute::bake(room, *partition, options, progress, report);
  if (!volume)
    return volume.error();
  Pair pair{std::move(*volume), {}, {}, {}, {}, report.compact, process_seconds() - start};
  const ProbeSet& probes = pair.volume.probes;
  for (std::size_t p = 0; p < probes.size(); ++p)
    if (probes.valid[p]) {
      pair.valid.push_back(p);
      if (is_inner(probes, p))
        pair.inner.push_back(p);
    }
  auto cells = sun_cells(a.altitude_deg * kPi / 180);
  if (!cells)
    return cells.error();
  pair.cells = std::move(*cells);
  options.target_facets = a.exact_facets; // finer than the elements that the compact basis lights
  options.gather_rays = a.exact_rays;
  auto truth = precompute::bake(room, pair.cells.partition, options, progress, truth_report);
  if (!truth)
    return truth.error();
  pair.truth = std::move(*truth);
  return pair;
}

/// Norms over all valid coefficients, sun by sun: of the truth, of the error, and of the change since the sun before.
struct Track {
  std::vector<double> norm, error, inner_norm, inner_error, step, true_step;
};

Track follow_sun(const Pair& pair) {
  Track track;
  const LightField black{std::vector<Sh9Rgb>(pair.truth.probes.size())};
  LightField last, last_true = black;
  for (int k = 0; k < kSteps; ++k) {
    std::vector<Rgb> exact(static_cast<std::size_t>(pair.cells.partition.size()), Rgb(0.0f));
    for (const int cell : {k, (k + 1) % kSteps})
      exact[static_cast<std::size_t>(pair.cells.first + cell)] = Rgb(1.0f);
    const LightField t = combine(pair.truth, exact);
    const LightField f = combine(pair.volume, sun_on_nodes(pair.volume.partition, pair.cells, k));
    track.norm.push_back(distance(t, black, pair.valid));
    track.error.push_back(distance(t, f, pair.valid));
    track.inner_norm.push_back(distance(t, black, pair.inner));
    track.inner_error.push_back(distance(t, f, pair.inner));
    if (k > 0) {
      track.true_step.push_back(distance(t, last_true, pair.valid));
      track.step.push_back(distance(last, f, pair.valid));
    }
    last = f;
    last_true = t;
  }
  return track;
}

/// Suns that light less than a tenth of the brightest do not count in the relative error; every step counts.
nlohmann::json score(const Track& track) {
  const double most = *std::ranges::max_element(track.norm);
  double squares = 0, inner_squares = 0, worst = 0, worst_step = 0;
  int suns = 0, above = 0;
  for (std::size_t k = 0; k < track.norm.size(); ++k)
    if (track.norm[k] > 0.1 * most) {
      const double relative = track.error[k] / track.norm[k];
      squares += relative * relative;
      inner_squares += std::pow(track.inner_error[k] / std::max(track.inner_norm[k], 1e-30), 2.0);
      worst = std::max(worst, relative);
      ++suns;
    }
  for (std::size_t k = 0; k < track.step.size(); ++k) {
    const double ratio = track.step[k] / (1.5 * track.true_step[k] + 1e-3 * most);
    worst_step = std::max(worst_step, ratio);
    above += ratio > 1 ? 1 : 0;
  }
  return {{"suns", suns},
          {"sun_rms_error", std::sqrt(squares / std::max(suns, 1))},
          {"sun_rms_error_inside", std::sqrt(inner_squares / std::max(suns, 1))},
          {"sun_worst_error", worst},
          {"step_over_bound", worst_step},
          {"steps_above_bound", above}};
}

/// Of the light where the sun is brightest, per step: how far the coefficients moved, and the exact ones.
void add_steps(const Track& track, nlohmann::json& row) {
  const double most = *std::ranges::max_element(track.norm);
  const auto rounded = [most](const std::vector<double>& values) {
    nlohmann::json list = nlohmann::json::array();
    for (const double v : values)
      list.push_back(std::round(1e6 * v / most) / 1e6);
    return list;
  };
  row["step"] = rounded(track.step);
  row["true_step"] = rounded(track.true_step);
}

void add_times(const Pair& pair, nlohmann::json& row) {
  VolumeCombiner combiner = VolumeCombiner::make(pair.volume);
  const std::vector<Rgb> uniform(static_cast<std::size_t>(pair.volume.partition.size()), Rgb(1.0f)),
      dim(uniform.size(), Rgb(0.5f));
  bool odd = false;
  const auto update = [&] { combiner.update((odd = !odd) ? uniform : dim); };
  double wall = 1e9;
  for (int r = 0; r < 50; ++r)
    wall = std::min(wall, wall_time_once(update));
  set_thread_count(1);
  const double one_core = alternate(50, update)[0];
  set_thread_count(0);
  row["combine_ms"] = 1e3 * wall;
  row["combine_one_core_ms"] = 1e3 * one_core;
}

Result<nlohmann::json> measure(const RoomFile& room, int nodes, const Arguments& a, const Progress& progress) {
  const auto pair = bake_both(room, nodes, a, progress);
  if (!pair)
    return pair.error();
  const Track track = follow_sun(*pair);
  nlohmann::json row = score(track);
  add_steps(track, row);
  row["nodes"] = nodes;
  row["nodes_stored"] = pair->compact.nodes;
  row["probes"] = pair->valid.size();
  row["altitude_deg"] = a.altitude_deg;
  row["exact_facets"] = a.exact_facets;
  row["compression_error"] = pair->compact.rms_error;
  row["compact_megabytes"] = double(pair->compact.bytes) / 1e6;
  row["bake_cpu_seconds"] = pair->bake_seconds;
  add_times(*pair, row);
  return row;
}

Result<void> run(const Arguments& a, const CommonOptions& options) {
  const auto room = read_room(a.room, UpAxis::z);
  if (!room)
    return room.error();
  nlohmann::json document = {{"machine", machine()}};
  if (!options.json)
    std::printf(
        "nodes  sun error %% (worst)  step/bound (above)  compression %%     MB  bake cpu s  combine ms (one core)\n");
  for (const int nodes : a.nodes) {
    ProgressLine progress(options.quiet);
    const auto row = measure(*room, nodes, a, progress.callback());
    progress.clear();
    if (!row)
      return row.error();
    document["rows"].push_back(*row);
    const auto number = [&](const char* key) { return (*row)[key].get<double>(); };
    if (!options.json)
      std::printf("%5d %10.2f (%6.2f) %13.2f (%3.0f) %15.2f %8.1f %10.1f %10.3f (%.3f)\n", nodes,
                  100 * number("sun_rms_error"), 100 * number("sun_worst_error"), number("step_over_bound"),
                  number("steps_above_bound"), 100 * number("compression_error"), number("compact_megabytes"),
                  number("bake_cpu_seconds"), number("combine_ms"), number("combine_one_core_ms"));
  }
  return deliver(document, options);
}

} // namespace

Command add_fine_sky(CLI::App& program) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* parser = program.add_subcommand("fine-sky", "a moving sun under a compact basis against exact suns");
  parser->add_option("ROOM", arguments->room, "room model")->required();
  parser->add_option("--nodes", arguments->nodes, "directions")->delimiter(',')->capture_default_str();
  parser->add_option("--altitude", arguments->altitude_deg, "of the sun, degrees")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 85.0));
  parser->add_option("--error", arguments->error, "asked of the compression")->capture_default_str();
  parser->add_option("--exact-patches", arguments->exact_facets, "of the room under the exact suns")
      ->capture_default_str()
      ->check(CLI::Range(100, 50000));
  parser->add_option("--exact-rays", arguments->exact_rays, "per probe, under the exact suns")
      ->capture_default_str()
      ->check(CLI::Range(64, 1 << 20));
  return {parser, [arguments](const CommonOptions& options) { return run(*arguments, options); }};
}

} // namespace daylit::bench
