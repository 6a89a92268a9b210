#pragma once

// `daylit-precompute check ROOM`: what a bake would find, without one.

#include "scene/core/command_line.h"

namespace daylit::precompute {

/// Of both commands: the widest joint that is filled, millimetres.
void add_close_gaps_option(CLI::App& app, double& millimetres);

/// Arguments from "check" on; the exit code of the program (0 the room can be baked, 1 it cannot, 2 usage). The report
/// goes to stdout.
int check_command(int argc, char** argv);

} // namespace daylit::precompute
