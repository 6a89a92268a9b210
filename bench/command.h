#pragma once

// A sub-command of daylit-bench: one function per command, listed in the table of main.cpp. A command adds its options
// to the program's parser and returns what to run when it is chosen.

#include <functional>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "scene/core/program.h"
#include "scene/core/result.h"

namespace CLI {
class App;
}

namespace daylit::bench {

/// Options that every sub-command shares, filled in before the command runs.
struct CommonOptions {
  int threads = 0;
  bool quiet = false;
  bool json = false;
  std::string output; ///< JSON file, empty: none
};

struct Command {
  CLI::App* parser = nullptr;
  /// Runs, prints its table to stdout (or its JSON when options.json) and writes options.output.
  std::function<Result<void>(const CommonOptions&)> run;
};

using AddCommand = Command (*)(CLI::App& program);

Command add_camera(CLI::App& program); ///< only where capture is built
Command add_combine(CLI::App& program);
Command add_direct(CLI::App& program);        ///< only where everything is built
Command add_error_vs_time(CLI::App& program); ///< only where radiosity and simulate are built
Command add_fine_sky(CLI::App& program);      ///< only where radiosity and simulate are built
Command add_maps(CLI::App& program);          ///< only where the runtime is built
Command add_markers(CLI::App& program);       ///< only where capture and simulate are built
Command add_rooms(CLI::App& program);         ///< only where radiosity and simulate are built
Command add_sh(CLI::App& program);
Command add_sky_projection(CLI::App& program);
Command add_transport(CLI::App& program);       ///< only where radiosity and simulate are built
Command add_transport_cost(CLI::App& program);  ///< the same
Command add_transport_rooms(CLI::App& program); ///< the same
Command add_selftest(CLI::App& program);        ///< the same
Command add_volume(CLI::App& program);          ///< the same
Command add_flicker(CLI::App& program);         ///< the same, and the runtime
Command add_frame(CLI::App& program);           ///< the same
Command add_sequence(CLI::App& program);        ///< the same

/// Writes `document` as options ask: to the file, and to stdout when --json.
Result<void> deliver(const nlohmann::json& document, const CommonOptions& options);

/// Processor, compiler, vector instructions and version: the head of every report.
nlohmann::json machine();

} // namespace daylit::bench
