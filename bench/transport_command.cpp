// daylit-bench transport: error of the bake against its cost, for facet count x visibility rays, on generated rooms.
// Reference: the path tracer's indirect irradiance at the same points, with its own standard error beside it.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "bench/bench_rooms.h"
#include "bench/command.h"
#include "precompute/room_frame.h"
#include "scene/core/seconds.h"
#include "simulate/irradiance.h"

namespace daylit::bench {
namespace {

struct Arguments {
  std::vector<int> facets = {250, 500, 1000, 2000, 4000, 8000};
  std::vector<int> rays = {16384, 131072};
  int reference_samples = 16384;
};

struct Reference {
  std::vector<Receiver> receivers;
  std::vector<IrradianceEstimate> value;
};

/// Six axes at every point under a uniform sky of radiance 1, below the horizon too.
Result<Reference> trace_reference(const BenchRoom& room, int samples, const Progress& progress) {
  const auto rays = RayScene::build(room.file.room);
  if (!rays)
    return rays.error();
  const auto apertures = find_apertures(room.file.room, *rays);
  if (!apertures)
    return apertures.error();
  SkyModel sky;
  sky.kind = SkyModel::Kind::uniform;
  sky.ground_albedo = -1.0f;
  sky.ground_radiance = Rgb(1.0f);
  const auto scene = TraceScene::make(room.file.room, apertures->list, SkyLight(sky));
  if (!scene)
    return scene.error();
  Reference r;
  for (const glm::dvec3& p : room.points)
    for (int axis = 0; axis < 3; ++axis)
      for (const double sign : {1.0, -1.0}) {
        r.receivers.push_back({p, glm::dvec3(0.0)});
        r.receivers.back().normal[axis] = sign;
      }
  auto traced = trace_irradiance(*scene, r.receivers, {.samples = samples}, progress);
  if (!traced)
    return traced.error();
  r.value = std::move(*traced);
  return r;
}

struct Score {
  double nrms = 0, reference_error = 0;
};

Result<Score> score(const BasisVolume& volume, const Reference& reference) {
  const auto sampler = LightFieldSampler::make(volume);
  if (!sampler)
    return sampler.error();
  const LightField field = combine(volume, std::vector<Rgb>(volume.partition.size(), Rgb(1.0f)));
  double error = 0, power = 0, noise = 0;
  for (std::size_t i = 0; i < reference.receivers.size(); ++i) {
    const auto c = sampler->sample(field, reference.receivers[i].position);
    if (!c)
      return Error{ErrorCode::not_found, "no light field at a bench point", "transport", ""};
    const Rgb e = irradiance(*c, glm::vec3(reference.receivers[i].normal));
    for (int k = 0; k < 3; ++k) {
      const double t = static_cast<double>(reference.value[i].value[k]), d = static_cast<double>(e[k]) - t;
      const double s = static_cast<double>(reference.value[i].standard_error[k]);
      error += d * d;
      power += t * t;
      noise += s * s;
    }
  }
  return Score{std::sqrt(error / power), std::sqrt(noise / power)};
}

Result<nlohmann::json> measure(const BenchRoom& room, int facets, int rays, bool low_rank, const Reference& reference) {
  precompute::BakeOptions options;
  options.target_facets = facets;
  options.visibility_rays = rays;
  options.low_rank_tolerance = low_rank ? options.low_rank_tolerance : 0.0;
  options.points = room.points;
  precompute::BakeReport report;
  const double start = process_seconds();
  const auto volume = precompute::bake_room(
      room.file, *SkyPartition::uniform(64), options, [](const std::string&, double) { return !interrupted(); },
      report);
  if (!volume)
    return volume.error();
  const double seconds = process_seconds() - start;
  const auto s = score(*volume, reference);
  if (!s)
    return s.error();
  return nlohmann::json{{"room", room.name},
                        {"facets", report.facets},
                        {"rays", rays},
                        {"method", low_rank ? "hierarchical" : "all entries"},
                        {"matrix_bytes", report.exchange.bytes},
                        {"cpu_seconds", seconds},
                        {"nrms", s->nrms},
                        {"reference_standard_error", s->reference_error},
                        {"energy_imbalance", report.energy.imbalance},
                        {"worst_closure", report.closure.worst}};
}

/// Every number of rays with the hierarchical matrix, the largest also with all entries kept.
std::vector<std::pair<int, bool>> settings(const Arguments& a) {
  std::vector<std::pair<int, bool>> all;
  for (const int rays : a.rays)
    all.emplace_back(rays, true);
  if (!a.rays.empty())
    all.emplace_back(*std::ranges::max_element(a.rays), false);
  return all;
}

Result<void> run(const Arguments& a, const CommonOptions& options) {
  const auto rooms = bench_rooms();
  if (!rooms)
    return rooms.error();
  nlohmann::json document = {{"machine", machine()}, {"sky", "uniform"}, {"regions", 64}};
  document["machine"]["clock"] = "process CPU time, all threads";
  if (!options.json)
    std::printf("room      facets    rays method        matrix MB  cpu s   error %%  (reference's own)  imbalance  "
                "worst closure\n");
  for (const BenchRoom& room : *rooms) {
    ProgressLine progress(options.quiet);
    const auto reference = trace_reference(room, a.reference_samples, progress.callback());
    progress.clear();
    if (!reference)
      return reference.error();
    for (const auto& [rays, low_rank] : settings(a))
      for (const int facets : a.facets) {
        const auto row = measure(room, facets, rays, low_rank, *reference);
        if (!row)
          return row.error();
        document["rows"].push_back(*row);
        if (!options.json)
          std::printf("%-9s %7d %7d %-12s %10.1f %6.2f %8.3f %18.3f %12.1e %12.1e\n", room.name.c_str(),
                      (*row)["facets"].get<int>(), rays, (*row)["method"].get<std::string>().c_str(),
                      1e-6 * (*row)["matrix_bytes"].get<double>(), (*row)["cpu_seconds"].get<double>(),
                      100 * (*row)["nrms"].get<double>(), 100 * (*row)["reference_standard_error"].get<double>(),
                      (*row)["energy_imbalance"].get<double>(), (*row)["worst_closure"].get<double>());
      }
  }
  return deliver(document, options);
}

} // namespace

Command add_transport(CLI::App& program) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* parser =
      program.add_subcommand("transport", "error of the bake against its time, on three generated rooms");
  parser->add_option("--patches", arguments->facets, "facet counts")->delimiter(',')->capture_default_str();
  parser->add_option("--rays", arguments->rays, "visibility rays per unit of form factor")
      ->delimiter(',')
      ->capture_default_str();
  parser->add_option("--reference-samples", arguments->reference_samples, "paths per point of the reference")
      ->check(CLI::Range(16, 1 << 22));
  return {parser, [arguments](const CommonOptions& options) { return run(*arguments, options); }};
}

} // namespace daylit::bench
