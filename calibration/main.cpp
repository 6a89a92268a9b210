// daylit-calibrate: what the runtime assumes about cameras, measured.

#include <algorithm>

#include <cblas.h>

#include "calibration/command.h"
#include "radiosity/matrix_kernels.h"
#include "scene/core/prompt_exit.h"

int main(int argc, char** argv) {
  using namespace daylit;
  radiosity::use_matrix_kernels_of_this_processor(argv);
  watch_for_interrupt(); // first: an interrupt may come at once
  calibration::CommonOptions options;
  for (int i = 0; i < argc; ++i)
    options.command_line += (i ? " " : "") + std::string(i ? argv[i] : "daylit-calibrate");
  CLI::App app{"Measures what the runtime assumes about its cameras.\n"
               "Example: daylit-calibrate fisheye board*.jpg --board 9x6 --square 0.03 -o fisheye.yaml --report out"};
  app.set_version_flag("--version", DAYLIT_VERSION);
  app.require_subcommand(1);
  std::vector<calibration::Command> commands = calibration::add_lens_commands(app, options);
  commands.push_back(calibration::add_response_command(app, options));
  commands.push_back(calibration::add_merge_command(app, options));
  commands.push_back(calibration::add_colour_command(app, options));
  commands.push_back(calibration::add_align_command(app, options));
  commands.push_back(calibration::add_vignette_command(app, options));
  commands.push_back(calibration::add_materials_command(app, options));
  commands.push_back(calibration::add_room_command(app, options));
  commands.push_back(calibration::add_stitch_command(app, options));
  commands.push_back(calibration::add_print_command(app, options));
  if (const auto code = parse_command_line(app, argc, argv))
    return *code;
  const PromptExit at_interrupt;
  openblas_set_num_threads(1); // OpenCV's small systems: starting its threads costs more than they save
  const auto named = std::ranges::find_if(commands, [](const auto& c) { return c.app->parsed(); });
  const int code = run_program("daylit-calibrate", options.json, named->run);
  return code == kExitDone && options.nothing_written ? kExitFailed : code;
}
