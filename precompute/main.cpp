// daylit-precompute: room in, basis irradiance volume out.

#include <cstdio>
#include <filesystem>
#include <span>
#include <string_view>

#include <CLI/CLI.hpp>

#include "precompute/bake.h"
#include "precompute/check_command.h"
#include "precompute/checkpoint.h"
#include "precompute/probes.h"
#include "precompute/room_frame.h"
#include "scene/checksum.h"
#include "scene/volume_file.h"

namespace {

using namespace daylit;

struct Arguments {
  std::filesystem::path room, output, points;
  std::string regions, grid, quality = "normal", up = "z";
  double spacing_m = 0, patch_size_m = 0;
  int threads = 0, patches = 0;
  bool quiet = false, json = false, drop_bad_faces = false, resume = false;
  std::string command_line; ///< what decides the content of the volume: no output name, threads or messages
};

Result<glm::ivec3> parse_grid(const std::string& text) {
  glm::ivec3 n(0);
  char rest = 0;
  if (std::sscanf(text.c_str(), "%d,%d,%d%c", &n.x, &n.y, &n.z, &rest) != 3 || n.x < 2 || n.y < 2 || n.z < 2)
    return Error{ErrorCode::usage, "'" + text + "' is not a grid", "--grid", "three numbers of at least 2, as 8,8,8"};
  return n;
}

Result<precompute::BakeOptions> to_options(const Arguments& a) {
  Result<precompute::BakeOptions> options = precompute::quality_options(a.quality, !a.points.empty());
  if (!options)
    return options;
  if (!a.grid.empty()) {
    const Result<glm::ivec3> grid = parse_grid(a.grid);
    if (!grid)
      return grid.error();
    options->grid = *grid;
  }
  if (a.spacing_m > 0)
    options->spacing_m = a.spacing_m;
  options->patch_edge_m = a.patch_size_m;
  if (a.patches > 0)
    options->target_patches = a.patches;
  if (!a.points.empty()) {
    Result<std::vector<glm::dvec3>> points = precompute::read_points(a.points);
    if (!points)
      return points.error();
    options->points = std::move(*points);
  }
  return options;
}

Result<void> run(const Arguments& a) {
  set_thread_count(a.threads);
  Result<precompute::BakeOptions> options = to_options(a);
  if (!options)
    return options.error();
  // A grid keeps a fine sky in few bytes; given points are few enough to keep theirs whole.
  const std::string regions = !a.regions.empty() ? a.regions : (a.points.empty() ? "fine:16384" : "uniform:256");
  const Result<SkyPartition> partition = SkyPartition::parse(regions);
  if (!partition)
    return partition.error();
  const Result<RoomFile> room = read_room(a.room, a.up == "y" ? UpAxis::y : UpAxis::z);
  if (!room)
    return room.error();
  if (const Result<void> clean = refuse_dropped_faces(room->report, a.room); !clean && !a.drop_bad_faces)
    return clean.error();
  std::filesystem::path checkpoint_path = a.output;
  checkpoint_path += ".checkpoint";
  std::string identity = DAYLIT_VERSION "\n" + a.command_line + "\n" + room->content_hash + "\n";
  for (const glm::dvec3& p : options->points)
    identity.append(reinterpret_cast<const char*>(&p), sizeof p);
  Result<std::unique_ptr<precompute::Checkpoint>> checkpoint =
      precompute::Checkpoint::open(checkpoint_path, checksum64(std::as_bytes(std::span(identity))), a.resume);
  if (!checkpoint)
    return checkpoint.error();
  options->store = checkpoint->get();
  precompute::BakeReport report;
  ProgressLine progress(a.quiet);
  Result<BasisVolume> volume = precompute::bake_room(*room, *partition, *options, progress.callback(), report);
  if (!volume)
    return volume.error();
  volume->provenance = {DAYLIT_VERSION, a.command_line, a.room.filename().string(), room->content_hash,
                        precompute::to_json(report, false)};
  if (const Result<void> written = write_volume(a.output, *volume); !written)
    return written.error();
  (*checkpoint)->remove();
  progress.clear();
  if (a.json)
    std::printf("%s\n", precompute::to_json(report).c_str());
  else if (!a.quiet)
    std::fprintf(stderr, "%s%s: %.2f MB\n", precompute::to_text(report).c_str(), a.output.c_str(),
                 static_cast<double>(std::filesystem::file_size(a.output)) / 1e6);
  return {};
}

/// The arguments that decide what is in the volume.
std::string content_arguments(int argc, char** argv) {
  std::string text = "daylit-precompute";
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    if (word == "-o" || word == "--output" || word == "--threads")
      ++i;
    else if (word != "--resume" && word != "--quiet" && word != "--json" && !word.starts_with("--output=") &&
             !word.starts_with("--threads=") && !word.starts_with("-o"))
      text += " " + std::string(word);
  }
  return text;
}

} // namespace

int main(int argc, char** argv) {
  if (argc > 1 && std::string_view(argv[1]) == "check")
    return precompute::check_command(argc - 1, argv + 1);
  Arguments a;
  a.command_line = content_arguments(argc, argv);
  CLI::App app{"Computes the basis irradiance volume of a room.\n"
               "Example: daylit-precompute room.obj -o room.volume\n"
               "`daylit-precompute check ROOM` says what a bake would find, without baking."};
  app.set_version_flag("--version", DAYLIT_VERSION);
  app.add_option("ROOM", a.room, "room model: OBJ (z up) or glTF 2.0 (.gltf, .glb); metres")->required();
  app.add_option("-o,--output", a.output, "the .volume file to write")->required();
  app.add_option("--regions", a.regions,
                 "uniform:N, tregenza, reinhart:K, or fine:N for a sharp sun\n"
                 "(default: fine:16384; with --points uniform:256)");
  auto* grid = app.add_option("--grid", a.grid, "probes per axis, NX,NY,NZ");
  auto* spacing =
      app.add_option("--spacing", a.spacing_m, "largest distance of probes, metres")->check(CLI::PositiveNumber);
  auto* points = app.add_option("--points", a.points, "file of probe positions, x y z per line: no grid");
  grid->excludes(spacing)->excludes(points);
  spacing->excludes(points);
  auto* patch_size = app.add_option("--patch-size", a.patch_size_m,
                                    "longest patch edge, metres (default: about 2,500 patches; 4,000 with --points)")
                         ->check(CLI::PositiveNumber);
  app.add_option("--patches", a.patches, "about this many patches; models of many small faces get more")
      ->check(CLI::Range(50, 60000))
      ->excludes(patch_size);
  app.add_option("--quality", a.quality, "draft, normal or high")->capture_default_str();
  app.add_option("--up", a.up, "axis that points up in the model, y or z")->check(CLI::IsMember({"y", "z"}));
  app.add_flag("--drop-bad-faces", a.drop_bad_faces, "leave out faces without area and duplicates, and report them");
  app.add_flag("--resume", a.resume, "go on from OUT.volume.checkpoint, which an interrupted run leaves");
  app.add_option("--threads", a.threads, "worker threads, 0 = all cores")->check(CLI::NonNegativeNumber);
  app.add_flag("--quiet", a.quiet, "no progress, no summary");
  app.add_flag("--json", a.json, "the report as JSON on stdout");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kExitDone : kExitUsage;
  }
  watch_for_interrupt();
  return run_program("daylit-precompute", a.json, [&] { return run(a); });
}
