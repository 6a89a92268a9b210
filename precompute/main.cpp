// daylit-precompute: room in, basis irradiance volume out.

#include <cstdio>
#include <filesystem>
#include <optional>
#include <span>
#include <string_view>

#include <fmt/format.h>
#include <unistd.h>

#include "precompute/adaptive_sky.h"
#include "precompute/check_command.h"
#include "precompute/checkpoint.h"
#include "precompute/memory_need.h"
#include "precompute/parse_options.h"
#include "precompute/planned_bake.h"
#include "precompute/probes.h"
#include "precompute/room_around.h"
#include "precompute/room_frame.h"
#include "precompute/room_survey.h"
#include "precompute/transport_model.h"
#include "radiosity/matrix_kernels.h"
#include "scene/core/atomic_file.h"
#include "scene/core/checksum.h"
#include "scene/core/command_line.h"
#include "scene/core/memory.h"
#include "scene/core/output_file.h"
#include "scene/core/program.h"
#include "scene/core/prompt_exit.h"
#include "scene/volume/volume_file.h"

namespace {

using namespace daylit;

constexpr double kMillimetre = 1e-3, kMinute_s = 60;

/// Notes and questions, before the work begins.
void tell(const std::vector<std::string>& notes, const precompute::RoomSurvey& survey) {
  for (const std::vector<std::string>* list : {&notes, &survey.apertures.report.notes})
    for (const std::string& note : *list)
      std::fprintf(stderr, "note       %s\n", note.c_str());
  for (const std::string& question : survey.questions)
    std::fprintf(stderr, "question   %s\n", question.c_str());
}

struct Arguments {
  std::filesystem::path room, output, points;
  std::string regions, grid, max_error, quality = "normal", up = "z", sh_order = "auto", density = "auto", stand_on,
                                        box, inside;
  double spacing_m = 0, patch_size_m = 0, close_gaps_mm = 0, memory_gb = 0, minutes = 0;
  int threads = 0, facets = 0;
  bool quiet = false, json = false, resume = false, force = false, once = false;
  std::vector<std::string> words; ///< of the command line, the program's name first
};

/// Where probes are wanted: a box, the room around a point, or empty.
Result<Bounds> wanted_box(const Arguments& a, const Room& room) {
  if (!a.box.empty())
    return precompute::parse_box(a.box);
  if (a.inside.empty())
    return Bounds{};
  const Result<glm::dvec3> point = precompute::parse_point(a.inside);
  return point ? precompute::room_around(room, *point) : Result<Bounds>(point.error());
}

/// What the command line fixes; the plan decides the rest.
Result<precompute::PlanRequest> to_request(const Arguments& a) {
  precompute::PlanRequest request;
  const Result<double> target =
      a.max_error.empty() ? precompute::parse_quality(a.quality) : precompute::parse_percent(a.max_error);
  if (!target)
    return target.error();
  request.max_error = *target;
  const Result<double> memory = precompute::allowed_memory(1e9 * a.memory_gb);
  if (!memory)
    return memory.error();
  request.memory_bytes = *memory;
  request.must_reach = !a.max_error.empty() || a.minutes > 0;
  request.seconds = kMinute_s * a.minutes;
  request.once = a.once;
  if (!a.grid.empty()) {
    const Result<glm::ivec3> grid = precompute::parse_grid(a.grid);
    if (!grid)
      return grid.error();
    request.grid = *grid;
  }
  request.spacing_m = a.spacing_m;
  if (a.density != "auto")
    request.graded = a.density == "graded";
  request.stand_on = a.stand_on;
  request.facet_edge_m = a.patch_size_m;
  request.facets = a.facets;
  request.regions = a.regions;
  if (a.sh_order != "auto")
    request.sh_order = a.sh_order == "4" ? ShOrder::fourth : ShOrder::second;
  if (!a.points.empty()) {
    Result<std::vector<glm::dvec3>> points = precompute::read_points(a.points);
    if (!points)
      return points.error();
    request.points = std::move(*points);
  }
  if (!a.regions.empty())
    if (const Result<void> good = precompute::check_regions(a.regions); !good)
      return good.error();
  return request;
}

/// Nothing is left to plan: facets, probes and sky are all given, and no error is wanted.
bool all_given(const Arguments& a) {
  return a.max_error.empty() && a.minutes == 0 && a.density != "graded" && (a.facets > 0 || a.patch_size_m > 0) &&
         (!a.grid.empty() || a.spacing_m > 0 || !a.points.empty()) && !a.regions.empty();
}

struct Outcome {
  BasisVolume volume;
  BasisPrecision precision = BasisPrecision::float32;
  std::string stored_report, report_json, text;
};

/// One bake without calibration: every setting is given, or that of the quality.
Result<Outcome> bake_as_given(const Arguments& a, const precompute::PlanRequest& request, const RoomFile& room,
                              radiosity::WorkStore& store, const Progress& progress) {
  Result<precompute::BakeOptions> options = precompute::quality_options(a.quality, !a.points.empty());
  if (!options)
    return options.error();
  options->grid = request.grid;
  if (request.spacing_m > 0)
    options->spacing_m = request.spacing_m;
  options->facet_edge_m = request.facet_edge_m;
  if (request.facets > 0)
    options->target_facets = request.facets;
  options->points = request.points;
  options->box = request.box;
  options->sh_order = request.sh_order.value_or(ShOrder::second);
  options->store = &store;
  options->memory_bytes = request.memory_bytes;
  precompute::BakeReport report;
  const auto partition = precompute::sky_for(room, request.regions, progress);
  if (!partition)
    return partition.error();
  auto volume = precompute::bake_room(room, *partition, *options, progress, report);
  if (!volume)
    return volume.error();
  return Outcome{std::move(*volume), BasisPrecision::float32, to_json(report, false), to_json(report), to_text(report)};
}

using PlanForTime = std::optional<precompute::BakePlan>;

/// Options that give the same bake as the time did.
std::string for_time(const PlanForTime& plan) {
  return plan ? fmt::format(" --max-error {:.2g} --once", 100 * plan->plan.max_error) : "";
}

/// Calibration bakes and the plan that --time decides, and which options give the same bits; empty without --time.
Result<PlanForTime> plan_for_time(const Arguments& a, const precompute::PlanRequest& request, const RoomFile& room,
                                  ProgressLine& progress) {
  if (a.minutes == 0)
    return PlanForTime{};
  auto plan = precompute::plan_bake(room, request, progress.callback());
  if (!plan)
    return plan.error();
  PlanForTime out(std::move(*plan));
  progress.clear();
  if (!a.quiet)
    std::fprintf(stderr, "the same bits again, on any machine: %s\n",
                 precompute::content_arguments(a.words, for_time(out)).c_str());
  return out;
}

/// Calibration bakes and plan where there is none, bake, and perhaps once more; says on stderr what it does.
Result<Outcome> bake_as_planned(const Arguments& a, const precompute::PlanRequest& request, const RoomFile& room,
                                PlanForTime plan, radiosity::WorkStore& store, ProgressLine& progress) {
  const auto announce = [&](const std::string& text) {
    progress.clear();
    if (!a.quiet)
      std::fputs(text.c_str(), stderr);
  };
  auto baked = plan ? precompute::bake_planned(room, std::move(*plan), &store, progress.callback(), announce)
                    : precompute::bake_to_error(room, request, &store, progress.callback(), announce);
  if (!baked)
    return baked.error();
  if (a.json)
    announce(missed_text(baked->plan, baked->measured));
  return Outcome{std::move(baked->volume), baked->plan.precision, to_json(*baked, false), to_json(*baked),
                 to_text(baked->report) + to_text(baked->plan, baked->measured)};
}

/// Room, plan or settings, bake with a checkpoint beside the output, volume, report. The identity of the checkpoint is
/// everything that decides the content of the volume.
Result<void> run(const Arguments& a) {
  set_thread_count(a.threads);
  Result<precompute::PlanRequest> request = to_request(a);
  if (!request)
    return request.error();
  Result<RoomFile> room = read_room(a.room, a.up == "y" ? UpAxis::y : UpAxis::z);
  if (!room)
    return room.error();
  precompute::RoomSurvey survey;
  if (const Result<void> good = precompute::survey_room(*room, kMillimetre * a.close_gaps_mm, survey); !good)
    return good.error();
  const Result<RoomFile> model = precompute::transport_model(*room);
  if (!model)
    return model.error();
  if (!a.quiet)
    tell(room->report.notes, survey);
  std::filesystem::path checkpoint_path = a.output;
  checkpoint_path += ".checkpoint";
  for (const auto& [path, kind] :
       {std::pair{&a.output, &kVolumeKind}, {&checkpoint_path, &precompute::kCheckpointKind}})
    if (const Result<void> writable = check_output(*path, *kind, a.force); !writable)
      return writable.error();
  const Result<Bounds> box = wanted_box(a, room->room);
  if (!box)
    return box.error();
  request->box = *box;
  ProgressLine progress(a.quiet);
  auto plan = plan_for_time(a, *request, *model, progress);
  if (!plan)
    return plan.error();
  const std::string command_line = precompute::content_arguments(a.words, for_time(*plan));
  std::string identity = DAYLIT_VERSION "\n" + command_line + "\n" + room->content_hash + "\n";
  for (const glm::dvec3& p : request->points)
    identity.append(reinterpret_cast<const char*>(&p), sizeof p);
  Result<std::unique_ptr<precompute::Checkpoint>> checkpoint =
      precompute::Checkpoint::open(checkpoint_path, checksum64(std::as_bytes(std::span(identity))), a.resume);
  if (!checkpoint)
    return checkpoint.error();
  if (const std::string& note = (*checkpoint)->note(); !note.empty() && !a.quiet)
    std::fprintf(stderr, "%s\n", note.c_str());
  Result<Outcome> baked = all_given(a) ? bake_as_given(a, *request, *model, **checkpoint, progress.callback())
                                       : bake_as_planned(a, *request, *model, std::move(*plan), **checkpoint, progress);
  if (!baked)
    return baked.error();
  baked->volume.simplified = precompute::simplified_surfaces(*model, *room);
  baked->volume.room = std::move(room->room);
  baked->volume.provenance = {DAYLIT_VERSION, command_line, a.room.filename().string(), room->content_hash,
                              baked->stored_report};
  if (const Result<void> written = write_volume(a.output, baked->volume, baked->precision); !written)
    return written.error();
  (*checkpoint)->remove();
  progress.clear();
  if (a.json)
    std::printf("%s\n", baked->report_json.c_str());
  else if (!a.quiet)
    std::fprintf(stderr, "%s%s: %.2f MB\n", baked->text.c_str(), a.output.c_str(),
                 static_cast<double>(std::filesystem::file_size(a.output)) / 1e6);
  return {};
}

/// Where probes stand.
void add_probe_options(CLI::App& app, Arguments& a) {
  auto* grid = app.add_option("--grid", a.grid, "probes per axis, NX,NY,NZ");
  auto* spacing =
      app.add_option("--spacing", a.spacing_m, "largest distance of probes, metres")->check(positive_number());
  auto* points = app.add_option("--points", a.points, "file of probe positions, x y z per line: no grid");
  auto* density =
      app.add_option("--density", a.density,
                     "graded: as many probes, closer together where the light changes fast; regular; auto: graded\n"
                     "where the number of probes is planned")
          ->capture_default_str()
          ->check(CLI::IsMember({"graded", "regular", "auto"}));
  auto* box = app.add_option("--box", a.box, "probes in here alone, X0,Y0,Z0,X1,Y1,Z1, metres")->excludes(points);
  app.add_option(
         "--inside", a.inside,
         "probes only in the room around this point, X,Y,Z; what lies behind its doors matters as far as light\n"
         "from there comes in")
      ->excludes(points)
      ->excludes(box);
  grid->excludes(spacing)->excludes(points);
  spacing->excludes(points);
  density->excludes(points);
  app.add_option("--stand-on", a.stand_on,
                 "material on which objects will stand: probes and the measurement are closer above its level faces\n"
                 "(default: all level faces with 10 cm of air above)")
      ->excludes(points)
      ->excludes(grid)
      ->excludes(spacing);
}

/// Options of a bake; `check` has its own (check_command).
int run_command(int argc, char** argv) {
  if (argc > 1 && std::string_view(argv[1]) == "check")
    return precompute::check_command(argc - 1, argv + 1);
  Arguments a;
  a.words.assign(argv, argv + argc);
  CLI::App app{"Computes the basis irradiance volume of a room.\n"
               "Example: daylit-precompute room.obj -o room.volume\n"
               "`daylit-precompute check ROOM` says what a bake would find, without baking."};
  app.set_version_flag("--version", DAYLIT_VERSION);
  app.add_option("ROOM", a.room, "room model: OBJ, glTF 2.0 (.gltf, .glb), Honeybee (.hbjson) or Radiance (.rad)")
      ->required();
  app.add_option("-o,--output", a.output, "the .volume file to write")->required();
  app.add_option("--regions", a.regions,
                 "uniform:N, tregenza, reinhart:K, adaptive:N (small where the room's light changes with the\n"
                 "direction), or fine:N for a sharp sun (default: planned)");
  add_probe_options(app, a);
  auto* patch_size =
      app.add_option("--patch-size", a.patch_size_m, "longest edge of the mesh, metres (default: planned)")
          ->check(positive_number());
  app.add_option("--patches", a.facets, "about this many facets in the mesh; models of many small faces get more")
      ->check(CLI::Range(50, 60000))
      ->excludes(patch_size);
  auto* time = app.add_option("--time", a.minutes,
                              "minutes that the bake may take: it has the smallest error that is predicted to fit, is\n"
                              "not repeated, and says which options give the same bits again (and --resume goes on by)")
                   ->check(positive_number());
  auto* max_error = app.add_option("--max-error", a.max_error,
                                   "error of the coefficients in per cent, nrms, that decides facets, probes, sky and\n"
                                   "rays; what is given beside it is kept. Twice as much under a small sun");
  app.add_option("--quality", a.quality, "draft, normal or high: a --max-error of 4, 2 or 1 %")
      ->capture_default_str()
      ->excludes(max_error)
      ->excludes(time);
  max_error->excludes(time);
  app.add_flag("--once", a.once, "no second bake where the first misses the error");
  app.add_option("--sh-order", a.sh_order,
                 "2: nine coefficients per probe; 4: those of l = 4 too, where they are worth their bytes to\n"
                 "irradiance; auto: where nine leave too much of the error")
      ->capture_default_str()
      ->check(CLI::IsMember({"2", "4", "auto"}));
  app.add_option("--up", a.up, "axis that points up in the model, y or z")->check(CLI::IsMember({"y", "z"}));
  precompute::add_close_gaps_option(app, a.close_gaps_mm);
  app.add_flag_callback(
         "--drop-bad-faces", [] {}, "what is done anyway; older scripts ask for it")
      ->group("");
  add_force_option(app, a.force);
  app.add_option(
         "--memory", a.memory_gb,
         "gigabytes that may be taken; a bake that needs more is refused before it starts (default: 60 % of the\n"
         "machine, or what its control group or ulimit -v leave)")
      ->check(positive_number());
  app.add_flag("--resume", a.resume, "go on from OUT.volume.checkpoint, written by an interrupted run");
  add_threads_option(app, a.threads);
  app.add_flag("--quiet", a.quiet, "no progress, no summary");
  app.add_flag("--json", a.json, "the report as JSON on stdout");
  if (const auto code = parse_command_line(app, argc, argv))
    return *code;
  const PromptExit at_interrupt; // what a bake has done is in its checkpoint
  return run_program("daylit-precompute", a.json, [&] { return run(a); });
}

} // namespace

int main(int argc, char** argv) {
  radiosity::use_matrix_kernels_of_this_processor(argv);
  watch_for_interrupt(); // first: an interrupt may come at once
  keep_freed_memory();
  const int code = run_command(argc, argv);
  // Where a limit leaves nothing, the threads of OpenBLAS do not end, and the process would wait for them.
  if (!precompute::allowed_memory(0)) {
    std::fflush(nullptr);
    ::_exit(code);
  }
  return code;
}
