// daylit-calibrate fisheye, camera.

#include <cstdio>
#include <memory>

#include "calibration/command.h"
#include "calibration/lens_calibration.h"

namespace daylit::calibration {

namespace {

struct LensOptions {
  std::string board;
  double square_m = 0;
};

/// "COLSxROWS", inner corners.
Result<BoardSize> parse_board(const std::string& text) {
  BoardSize size;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%dx%d%c", &size.columns, &size.rows, &rest) != 2 || size.columns < 3 ||
      size.rows < 3 || size.columns > 100 || size.rows > 100)
    return Error{ErrorCode::usage, "'" + text + "' is no board", "--board",
                 "inner corners, columns x rows, each 3 to 100, as 9x6"};
  return size;
}

/// Reads, finds, fits, judges; a lens file is written whatever the verdict, which is said, when there is a lens.
Result<void> calibrate(LensKind kind, CommonOptions& o, const LensOptions& lens) {
  const auto board = parse_board(lens.board);
  if (!board)
    return board.error();
  ProgressLine progress(o.quiet || o.json);
  const auto read = [&](std::size_t i) -> Result<BoardPicture> {
    auto picture = read_ldr_image(o.inputs[i]);
    if (!picture)
      return picture.error();
    return BoardPicture{o.inputs[i].filename().string(), std::move(*picture)};
  };
  const auto result = calibrate_lens(kind, *board, lens.square_m, o.inputs.size(), read, progress.callback());
  progress.clear();
  if (!result)
    return result.error();
  if (result->views.empty())
    return deliver_without_result(o, report_of(*result), result->why);
  return deliver_result(o, kLensKind, report_of(*result), [&] { return write_lens(o.output, result->fit.lens); });
}

Command add_lens_command(CLI::App& app, LensKind kind, const char* name, const char* what, CommonOptions& o,
                         const std::shared_ptr<LensOptions>& lens) {
  CLI::App* command = app.add_subcommand(name, what);
  add_common_options(*command, o, "photographs of the board, PNG or JPEG, of one camera",
                     "the lens file to write, YAML as ROS and Kalibr have it");
  command->add_option("--board", lens->board, "inner corners of the checkerboard, COLSxROWS")->required();
  command->add_option("--square", lens->square_m, "side of a square, metres")->required()->check(positive_number());
  return {command, [kind, &o, lens] { return calibrate(kind, o, *lens); }};
}

} // namespace

std::vector<Command> add_lens_commands(CLI::App& app, CommonOptions& o) {
  const auto lens = std::make_shared<LensOptions>();
  return {add_lens_command(app, LensKind::equidistant, "fisheye",
                           "lens of a fish-eye (equidistant, Kannala-Brandt), beyond 90 degrees too", o, lens),
          add_lens_command(app, LensKind::pinhole, "camera", "lens of an ordinary camera (pinhole with distortion)", o,
                           lens)};
}

} // namespace daylit::calibration
