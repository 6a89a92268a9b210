#pragma once

// Options that say which board is used. For the program alone: sees CLI11.

#include <string>

#include "calibration/command.h"
#include "calibration/target.h"

namespace daylit::calibration {

struct BoardOptions {
  std::string board, dictionary;
  double square_m = 0, marker_m = 0;
};

/// --board, --square, --dictionary, --marker.
void add_board_options(CLI::App& command, BoardOptions& options);
/// Error usage: no board, or a marker that is not smaller than its square.
Result<Target> target_of(const BoardOptions& options);

} // namespace daylit::calibration
