// daylit-calibrate: what the runtime assumes about cameras, measured.

#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "calibration/lens_calibration.h"
#include "scene/core/atomic_file.h"
#include "scene/core/command_line.h"
#include "scene/core/output_file.h"
#include "scene/core/program.h"

namespace {

using namespace daylit;

constexpr FileKind kReportKind{"a report of daylit-calibrate", "<!doctype html><html lang='en'><meta charset='utf-8'>"};

struct Arguments {
  std::vector<std::filesystem::path> inputs;
  std::filesystem::path output, report;
  std::string board, command_line;
  double square_m = 0;
  bool json = false, quiet = false, force = false;
};

/// "COLSxROWS", inner corners.
Result<calibration::BoardSize> parse_board(const std::string& text) {
  calibration::BoardSize size;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%dx%d%c", &size.columns, &size.rows, &rest) != 2 || size.columns < 3 ||
      size.rows < 3 || size.columns > 100 || size.rows > 100)
    return Error{ErrorCode::usage, "'" + text + "' is no board", "--board",
                 "inner corners, columns x rows, each 3 to 100, as 9x6"};
  return size;
}

/// Lens file and report, when all pictures have been read: neither may be one of them.
Result<void> check_outputs(const Arguments& a) {
  if (const Result<void> good = check_output(a.output, kLensKind, a.force); !good)
    return good;
  if (a.report.empty())
    return {};
  std::error_code failed;
  std::filesystem::create_directories(a.report, failed);
  return check_output(a.report / "report.html", kReportKind, a.force);
}

/// Reads, finds, fits, judges; the lens file is written whatever the verdict, which is said.
Result<void> calibrate(LensKind kind, const Arguments& a) {
  const auto board = parse_board(a.board);
  if (!board)
    return board.error();
  ProgressLine progress(a.quiet || a.json);
  const auto read = [&](std::size_t i) -> Result<calibration::BoardPicture> {
    auto picture = read_ldr_image(a.inputs[i]);
    if (!picture)
      return picture.error();
    return calibration::BoardPicture{a.inputs[i].filename().string(), std::move(*picture)};
  };
  auto result = calibration::calibrate_lens(kind, *board, a.square_m, a.inputs.size(), read, progress.callback());
  progress.clear();
  if (!result)
    return result.error();
  if (const Result<void> good = check_outputs(a); !good)
    return good;
  if (const Result<void> written = write_lens(a.output, result->fit.lens); !written)
    return written;
  if (!a.report.empty()) {
    for (const auto& [name, text] :
         {std::pair{"report.html", to_html(*result, a.command_line)}, {"report.json", to_json(*result) + "\n"}})
      if (const Result<void> written = write_file_atomically(a.report / name, text); !written)
        return written;
  }
  if (a.json)
    std::printf("%s\n", to_json(*result).c_str());
  else if (!a.quiet)
    std::fprintf(stderr, "%s", to_text(*result).c_str());
  return {};
}

CLI::App* add_command(CLI::App& app, const char* name, const char* what, Arguments& a) {
  CLI::App* command = app.add_subcommand(name, what);
  command->add_option("PICTURES", a.inputs, "photographs of the board, PNG or JPEG, of one camera")->required();
  command->add_option("-o,--output", a.output, "the lens file to write, YAML as ROS and Kalibr have it")->required();
  command->add_option("--board", a.board, "inner corners of the checkerboard, COLSxROWS")->required();
  command->add_option("--square", a.square_m, "side of a square, metres")->required()->check(positive_number());
  command->add_option("--report", a.report, "folder for report.html and report.json");
  add_force_option(*command, a.force);
  command->add_flag("--quiet", a.quiet, "no progress, no summary");
  command->add_flag("--json", a.json, "verdict and figures as one JSON object on stdout");
  return command;
}

} // namespace

int main(int argc, char** argv) {
  Arguments a;
  for (int i = 0; i < argc; ++i)
    a.command_line += (i ? " " : "") + std::string(i ? argv[i] : "daylit-calibrate");
  CLI::App app{"Measures what the runtime assumes about its cameras.\n"
               "Example: daylit-calibrate fisheye board*.jpg --board 9x6 --square 0.03 -o fisheye.yaml --report out"};
  app.set_version_flag("--version", DAYLIT_VERSION);
  app.require_subcommand(1);
  const CLI::App* fisheye =
      add_command(app, "fisheye", "lens of a fish-eye (equidistant, Kannala-Brandt), beyond 90 degrees too", a);
  add_command(app, "camera", "lens of an ordinary camera (pinhole with distortion)", a);
  if (const auto code = parse_command_line(app, argc, argv))
    return *code;
  watch_for_interrupt();
  return run_program("daylit-calibrate", a.json,
                     [&] { return calibrate(fisheye->parsed() ? LensKind::equidistant : LensKind::pinhole, a); });
}
