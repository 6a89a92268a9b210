#pragma once

// One bake by the program itself, as a user starts it: what it took and what it says.

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "scene/core/result.h"

namespace daylit::bench {

struct ProgramRun {
  int exit_code = 0;
  bool out_of_time = false;
  double wall_s = 0, cpu_s = 0, peak_gb = 0;
  nlohmann::json report;  ///< what it printed with --json
  std::string last_words; ///< last line of stderr
};

/// Runs a program of this build with the arguments, for at most `limit_s` seconds; stdout and stderr go to
/// `log`.out and `log`.err. Error: it cannot be started, or this process was interrupted (the program is stopped too).
Result<ProgramRun> run_program_of_build(const std::string& program, const std::vector<std::string>& arguments,
                                        double limit_s, const std::filesystem::path& log);

} // namespace daylit::bench
