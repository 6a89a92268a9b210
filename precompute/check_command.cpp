#include "precompute/check_command.h"

#include <cstdio>
#include <filesystem>
#include <string>

#include "precompute/check_plot.h"
#include "precompute/room_check.h"
#include "scene/core/atomic_file.h"
#include "scene/core/output_file.h"
#include "scene/core/program.h"
#include "scene/core/prompt_exit.h"

namespace daylit::precompute {

namespace {

constexpr double kMillimetre = 1e-3, kWidestClosed_mm = 100;

Result<void> write_plot(const RoomCheck& check, const std::filesystem::path& path, bool force) {
  static constexpr FileKind kPage{"an HTML page", "<!doctype html>"};
  if (const Result<void> writable = check_output(path, kPage, force); !writable)
    return writable;
  const Result<std::string> page = check_page(check);
  return page ? write_file_atomically(path, *page) : page.error();
}

} // namespace

void add_close_gaps_option(CLI::App& app, double& millimetres) {
  app.add_option("--close-gaps", millimetres,
                 "fill joints through which light comes in, up to this wide, millimetres (default: they are told)")
      ->check(CLI::Range(0.0, kWidestClosed_mm));
}

int check_command(int argc, char** argv) {
  std::filesystem::path room, plot;
  std::string up = "z";
  bool json = false, quiet = false, force = false;
  int threads = 0;
  double close_gaps_mm = 0;
  CLI::App app{"Says what a bake would find in a room: openings, materials, faces, size, cost.\n"
               "Example: daylit-precompute check room.obj",
               "daylit-precompute check"};
  app.add_option("ROOM", room, "room model: OBJ, glTF 2.0 (.gltf, .glb), Honeybee (.hbjson) or Radiance (.rad)")
      ->required();
  app.add_option("--up", up, "axis that points up in the model, y or z")->check(CLI::IsMember({"y", "z"}));
  add_close_gaps_option(app, close_gaps_mm);
  app.add_option("--plot", plot, "the room in three dimensions, as one HTML page that loads nothing");
  add_force_option(app, force);
  add_threads_option(app, threads);
  app.add_flag("--quiet", quiet, "only the exit code and the error");
  app.add_flag("--json", json, "the report as one JSON object");
  if (const auto code = parse_command_line(app, argc, argv))
    return *code;
  const PromptExit at_interrupt;
  bool refused = false; // and told so in the report
  const int code = run_program("daylit-precompute check", json, [&]() -> Result<void> {
    set_thread_count(threads);
    ProgressLine progress(quiet || json);
    const Result<RoomCheck> check =
        check_room(room, up == "y" ? UpAxis::y : UpAxis::z, kMillimetre * close_gaps_mm, progress.callback());
    progress.clear();
    if (!check)
      return check.error();
    if (!plot.empty())
      if (const Result<void> drawn = write_plot(*check, plot, force); !drawn)
        return drawn;
    if (json)
      std::printf("%s\n", to_json(*check).c_str());
    else if (!quiet)
      std::fputs(to_text(*check).c_str(), stdout);
    if (!check->problem)
      return {};
    if (!json)
      return *check->problem;
    std::fprintf(stderr, "daylit-precompute check: %s\n", check->problem->message().c_str());
    refused = true;
    return {};
  });
  return refused && code == kExitDone ? kExitFailed : code;
}

} // namespace daylit::precompute
