// daylit-bench transport-cost: what the stages of a bake cost as the facets grow, the solver against the same run's
// dense matrix product, and one more sky region. The error of each solution (energy, closure, residual) stands beside.

#include <cstdio>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>
#include <cblas.h>
#include <nlohmann/json.hpp>
#include <sys/resource.h>

#include "bench/bench_rooms.h"
#include "bench/command.h"
#include "precompute/room_frame.h"
#include "scene/core/seconds.h"

namespace daylit::bench {
namespace {

struct Arguments {
  std::vector<int> facets = {2000, 8000};
  int regions = 64, more_regions = 1024;
};

/// Processor time of [P x P] [P x columns] in single precision, one thread: the yardstick of the solver.
double product_seconds(std::size_t p, std::size_t columns) {
  std::vector<float> a(p * p, 1e-3f), x(p * columns, 1.0f), y(p * columns);
  openblas_set_num_threads(1);
  double best = 1e300;
  for (int repeat = 0; repeat < 3; ++repeat) {
    const double start = process_seconds();
    cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, static_cast<int>(p), static_cast<int>(columns),
                static_cast<int>(p), 1.0f, a.data(), static_cast<int>(p), x.data(), static_cast<int>(columns), 0.0f,
                y.data(), static_cast<int>(columns));
    best = std::min(best, process_seconds() - start);
  }
  return best;
}

struct Bake {
  precompute::BakeReport report;
  double cpu_seconds = 0;
};

Result<Bake> bake(const BenchRoom& room, int facets, int regions, const CommonOptions& common) {
  precompute::BakeOptions options;
  options.target_facets = facets;
  options.grid = glm::ivec3(8);
  options.tolerance = 1e-4;
  Bake result;
  const auto partition = SkyPartition::uniform(regions);
  if (!partition)
    return partition.error();
  ProgressLine progress(common.quiet);
  const double start = process_seconds();
  const auto volume = precompute::bake_room(room.file, *partition, options, progress.callback(), result.report);
  progress.clear();
  if (!volume)
    return volume.error();
  result.cpu_seconds = process_seconds() - start;
  return result;
}

/// The same room with every surface at reflectance 0.8: the harder case of the two that users have.
BenchRoom bright(BenchRoom room) {
  for (Material& m : room.file.room.materials)
    if (!m.is_window)
      m.reflectance = Rgb(0.8f, 0.79f, 0.78f);
  return room;
}

Result<nlohmann::json> measure(const BenchRoom& room, int facets, const Arguments& a, const CommonOptions& common) {
  const auto few = bake(room, facets, a.regions, common);
  if (!few)
    return few.error();
  const auto many = bake(room, facets, a.more_regions, common);
  if (!many)
    return many.error();
  const precompute::BakeReport& r = few->report;
  nlohmann::json row = {
      {"room", room.name},
      {"facets", r.facets},
      {"regions", a.regions},
      {"columns", r.solve.residual.size()},
      {"cpu_seconds", few->cpu_seconds},
      {"wall_seconds", r.total_seconds},
      {"matrix_bytes", r.exchange.bytes},
      {"dense_bytes", 4.0 * static_cast<double>(r.patches) * static_cast<double>(r.patches)},
      {"iterations", r.solve.iterations},
      {"worst_residual", r.solve.worst_residual},
      {"energy_imbalance", r.energy.imbalance},
      {"worst_closure", r.closure.worst},
      {"cpu_ms_per_further_region", 1e3 * (many->cpu_seconds - few->cpu_seconds) / (a.more_regions - a.regions)}};
  for (const precompute::StageTime& s : r.stages)
    row["wall_of_stage"][s.name] = s.seconds;
  if (r.patches <= 10000) {
    const double product = product_seconds(r.patches, r.solve.residual.size());
    row["solve_in_matrix_products"] = r.solve.cpu_seconds / product;
    row["matrix_product_cpu_seconds"] = product;
  }
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  row["peak_memory_bytes_so_far"] = static_cast<double>(usage.ru_maxrss) * 1024.0;
  return row;
}

Result<void> run(const Arguments& a, const CommonOptions& options) {
  const auto rooms = bench_rooms();
  if (!rooms)
    return rooms.error();
  nlohmann::json document = {{"machine", machine()}, {"probes", "8 x 8 x 8"}, {"tolerance", 1e-4}};
  if (!options.json)
    std::printf(
        "room     facets columns  cpu s wall s  matrix MB (dense)  its residual solve/sgemm ms/region imbalance "
        "closure\n");
  for (const BenchRoom& room : {bright(rooms->front())})
    for (const int facets : a.facets) {
      const auto measured = measure(room, facets, a, options);
      if (!measured)
        return measured.error();
      const nlohmann::json& row = *measured;
      document["rows"].push_back(row);
      if (options.json)
        continue;
      std::printf("%-8s %7d %7d %6.2f %6.2f %10.1f %7.0f %4d %8.1e %11s %9.2f %9.1e %7.1e\n", room.name.c_str(),
                  row["facets"].get<int>(), row["columns"].get<int>(), row["cpu_seconds"].get<double>(),
                  row["wall_seconds"].get<double>(), 1e-6 * row["matrix_bytes"].get<double>(),
                  1e-6 * row["dense_bytes"].get<double>(), row["iterations"].get<int>(),
                  row["worst_residual"].get<double>(),
                  row.contains("solve_in_matrix_products")
                      ? std::to_string(row["solve_in_matrix_products"].get<double>()).substr(0, 5).c_str()
                      : "-",
                  row["cpu_ms_per_further_region"].get<double>(), row["energy_imbalance"].get<double>(),
                  row["worst_closure"].get<double>());
    }
  return deliver(document, options);
}

} // namespace

Command add_transport_cost(CLI::App& program) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* parser = program.add_subcommand(
      "transport-cost", "cost of a bake at reflectance 0.8 against facets; solver against a matrix product");
  parser->add_option("--patches", arguments->facets, "facet counts")->delimiter(',')->capture_default_str();
  parser->add_option("--regions", arguments->regions, "sky regions")->capture_default_str();
  parser->add_option("--more-regions", arguments->more_regions, "regions of the second bake")
      ->check(CLI::Range(65, 16384))
      ->capture_default_str();
  return {parser, [arguments](const CommonOptions& options) { return run(*arguments, options); }};
}

} // namespace daylit::bench
