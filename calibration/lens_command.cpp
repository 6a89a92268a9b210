// daylit-calibrate fisheye, camera.

#include <cstdio>
#include <memory>

#include "calibration/command.h"
#include "calibration/lens_calibration.h"
#include "calibration/lens_options.h"

namespace daylit::calibration {

namespace {

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
Result<void> calibrate(LensKind kind, CommonOptions& o, const BoardOptions& options) {
  const auto target = target_of(options);
  if (!target)
    return target.error();
  ProgressLine progress(o.quiet || o.json);
  const auto read = [&](std::size_t i) -> Result<BoardPicture> {
    auto picture = read_ldr_image(o.inputs[i]);
    if (!picture)
      return picture.error();
    return BoardPicture{o.inputs[i].filename().string(), std::move(*picture)};
  };
  const auto result = calibrate_lens(kind, *target, o.inputs.size(), read, progress.callback());
  progress.clear();
  if (!result)
    return result.error();
  if (result->views.empty())
    return deliver_without_result(o, report_of(*result), result->why);
  return deliver_result(o, kLensKind, report_of(*result), [&] { return write_lens(o.output, result->fit.lens); });
}

Command add_lens_command(CLI::App& app, LensKind kind, const char* name, const char* what, CommonOptions& o,
                         const std::shared_ptr<BoardOptions>& board) {
  CLI::App* command = app.add_subcommand(name, what);
  add_common_options(*command, o, "photographs of the board, PNG or JPEG, of one camera",
                     "the lens file to write, YAML as ROS and Kalibr have it");
  add_board_options(*command, *board);
  return {command, [kind, &o, board] { return calibrate(kind, o, *board); }};
}

} // namespace

void add_board_options(CLI::App& command, BoardOptions& o) {
  command.add_option("--board", o.board, "inner corners of the board, COLSxROWS");
  command.add_option("--square", o.square_m, "side of a square, metres")->check(positive_number());
  command.add_option("--dictionary", o.dictionary, "of the markers of a ChArUco board, as 6X6_250");
  command.add_option("--marker", o.marker_m, "side of a marker of a ChArUco board, metres")->check(positive_number());
}

Result<Target> target_of(const BoardOptions& o) {
  const auto size = parse_board(o.board);
  if (!size)
    return size.error();
  if (!(o.square_m > 0))
    return Error{ErrorCode::usage, "the side of a square is not given", "--square", "metres, as 0.03"};
  if (o.dictionary.empty() != (o.marker_m == 0) || o.marker_m >= o.square_m)
    return Error{ErrorCode::usage, "a ChArUco board has a dictionary, and markers that are smaller than its squares",
                 "--dictionary, --marker", "give both, or neither for a plain checkerboard"};
  return Target{*size, o.square_m, o.dictionary, o.marker_m};
}

std::vector<Command> add_lens_commands(CLI::App& app, CommonOptions& o) {
  const auto board = std::make_shared<BoardOptions>();
  return {add_lens_command(app, LensKind::equidistant, "fisheye",
                           "lens of a fish-eye (equidistant, Kannala-Brandt), beyond 90 degrees too", o, board),
          add_lens_command(app, LensKind::pinhole, "camera", "lens of an ordinary camera (pinhole with distortion)", o,
                           board)};
}

} // namespace daylit::calibration
