// daylit-bench: run time against error, as tables, JSON and (scripts/plot_*.py) plots.

#include <deque>

#include "bench/command.h"
#ifdef DAYLIT_BENCH_BAKE
#include "radiosity/matrix_kernels.h"
#endif
#include "scene/core/command_line.h"

namespace {

using namespace daylit;

constexpr bench::AddCommand kCommands[] = {
    bench::add_combine,
    bench::add_sh,
    bench::add_sky_projection,
#ifdef DAYLIT_BENCH_BAKE
    bench::add_error_vs_time,
    bench::add_fine_sky,
    bench::add_transport,
    bench::add_transport_cost,
    bench::add_transport_rooms,
    bench::add_rooms,
    bench::add_volume,
    bench::add_selftest,
#endif
#ifdef DAYLIT_BENCH_FRAME
    bench::add_direct,
    bench::add_flicker,
    bench::add_frame,
    bench::add_sequence,
#endif
#ifdef DAYLIT_BENCH_MAPS
    bench::add_maps,
#endif
#ifdef DAYLIT_BENCH_CAMERA
    bench::add_camera,
#endif
#ifdef DAYLIT_BENCH_MARKERS
    bench::add_markers,
#endif
};

} // namespace

int main(int argc, char** argv) {
#ifdef DAYLIT_BENCH_BAKE
  radiosity::use_matrix_kernels_of_this_processor(argv);
#endif
  watch_for_interrupt(); // first: an interrupt may come at once
  CLI::App app{"Run time against error, measured in one run.\nExample: daylit-bench sh -o sh.json"};
  app.set_version_flag("--version", DAYLIT_VERSION);
  app.fallthrough();
  app.require_subcommand(1);
  bench::CommonOptions options;
  add_threads_option(app, options.threads);
  app.add_flag("--quiet", options.quiet, "no progress");
  app.add_flag("--json", options.json, "the report as one JSON object on stdout");
  app.add_option("-o,--output", options.output, "the report as a JSON file");
  std::deque<bench::Command> commands;
  for (const bench::AddCommand add : kCommands)
    commands.push_back(add(app));
  if (const auto code = parse_command_line(app, argc, argv))
    return *code;
  set_thread_count(options.threads);
  return run_program("daylit-bench", options.json, [&]() -> Result<void> {
    for (const bench::Command& command : commands)
      if (*command.parser)
        return command.run(options);
    return Error{ErrorCode::usage, "no sub-command", "daylit-bench", "see daylit-bench --help"};
  });
}
