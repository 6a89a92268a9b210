// daylit-calibrate print: boards and a chart to photograph.

#include <cmath>
#include <cstdio>
#include <memory>
#include <set>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "calibration/board_print.h"
#include "calibration/command.h"
#include "calibration/lens_options.h"
#include "scene/core/atomic_file.h"

namespace daylit::calibration {

namespace {

constexpr FileKind kSvgKind{"an SVG drawing", "<svg"};

struct PrintOptions {
  BoardOptions board;
  double chart_m = 0, dots_per_inch = 300;
};

Result<void> run(const CommonOptions& o, const PrintOptions& options) {
  auto print = [&]() -> Result<BoardPrint> {
    if (options.chart_m > 0)
      return chart_print(options.chart_m);
    const auto target = target_of(options.board);
    return target ? board_print(*target) : Result<BoardPrint>(target.error());
  }();
  if (!print)
    return print.error();
  const bool svg = o.output.extension() == ".svg";
  if (const Result<void> good = check_output(o.output, svg ? kSvgKind : kPngKind, o.force); !good)
    return good;
  const Result<void> written = svg ? write_file_atomically(o.output, svg_of(*print))
                                   : write_png(o.output, picture_of(*print, options.dots_per_inch / 0.0254));
  if (!written)
    return written;
  if (o.json)
    std::printf("%s\n", nlohmann::json({{"width_m", print->size_m.x}, {"height_m", print->size_m.y}}).dump().c_str());
  else if (!o.quiet)
    std::fprintf(stderr, "%.0f x %.0f mm with its margin; print at 100 %% and measure a square afterwards\n",
                 1e3 * print->size_m.x, 1e3 * print->size_m.y);
  return {};
}

} // namespace

Command add_print_command(CLI::App& app, CommonOptions& o) {
  const auto options = std::make_shared<PrintOptions>();
  CLI::App* command = app.add_subcommand("print", "a board to print: SVG in true size, or PNG");
  command->add_option("-o,--output", o.output, "the file to write, .svg or .png")->required();
  add_force_option(*command, o.force);
  command->add_flag("--quiet", o.quiet, "no summary");
  command->add_flag("--json", o.json, "width and height in metres, the margin included, as one JSON object on stdout");
  add_board_options(*command, options->board);
  command
      ->add_option("--chart", options->chart_m,
                   "instead: a chart of 24 patches, so many metres wide, for simulated cameras")
      ->check(positive_number());
  command->add_option("--dpi", options->dots_per_inch, "of a PNG picture")
      ->check(CLI::Range(10.0, 2400.0))
      ->capture_default_str();
  return {command, [&o, options] { return run(o, *options); }};
}

} // namespace daylit::calibration
