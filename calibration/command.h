#pragma once

// What the subcommands of daylit-calibrate have in common. For the program alone: sees CLI11.

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "calibration/report.h"
#include "scene/core/command_line.h"
#include "scene/core/output_file.h"
#include "scene/core/program.h"

namespace daylit::calibration {

/// Options of every subcommand.
struct CommonOptions {
  std::vector<std::filesystem::path> inputs;
  std::filesystem::path output, report;
  std::string command_line;
  bool json = false, quiet = false, force = false;
  bool nothing_written = false; ///< the verdict is "repeat" and no result was written: exit code 1
};

/// A subcommand and what it does when it was the one named.
struct Command {
  CLI::App* app = nullptr;
  std::function<Result<void>()> run;
};

/// INPUT..., -o, --report, --force, --quiet, --json.
void add_common_options(CLI::App& command, CommonOptions& options, const char* inputs, const char* output);

/// When all inputs have been read: neither the output nor the page may be one of them.
Result<void> check_outputs(const CommonOptions& options, const FileKind& kind);
/// Writes page and JSON file, prints the summary or the JSON line; with --quiet the reasons of a "repeat" alone.
Result<void> deliver(const CommonOptions& options, const Report& report);
/// check_outputs(), the result by `write`, then the report: how a command with one output ends. A "repeat" does not
/// replace a file without --force, and says so.
Result<void> deliver_result(CommonOptions& options, const FileKind& kind, Report report,
                            const std::function<Result<void>()>& write);
/// The same where there is no result to write: the verdict is "repeat".
Result<void> deliver_without_result(CommonOptions& options, Report report, std::vector<std::string> faults);

/// A, B, C, ... as given to one option. Error usage: not so many numbers.
Result<std::vector<double>> parse_numbers(const std::string& text, std::size_t count, const std::string& option);

std::vector<Command> add_lens_commands(CLI::App& app, CommonOptions& options);
Command add_response_command(CLI::App& app, CommonOptions& options);
Command add_merge_command(CLI::App& app, CommonOptions& options);
Command add_colour_command(CLI::App& app, CommonOptions& options);
Command add_align_command(CLI::App& app, CommonOptions& options);
Command add_materials_command(CLI::App& app, CommonOptions& options);
Command add_room_command(CLI::App& app, CommonOptions& options);
Command add_vignette_command(CLI::App& app, CommonOptions& options);
Command add_stitch_command(CLI::App& app, CommonOptions& options);
Command add_print_command(CLI::App& app, CommonOptions& options);

} // namespace daylit::calibration
