#include "calibration/bracket_options.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace daylit::calibration {

namespace {
constexpr float kAlike = 0.01f;     ///< of the largest code
constexpr double kNearlyAll = 0.98; ///< of the places
} // namespace

void add_bracket_options(CLI::App& command, BracketOptions& o) {
  command.add_option("--exposures", o.exposures,
                     "exposure times T1,T2,... in seconds, in the order of the pictures; else from their EXIF parts");
  command.add_option("--exposure-list", o.list, "text file with a file name and an exposure time on each line");
  command.add_option("--mosaic", o.mosaic, "what pictures with one channel are: mono, rggb, grbg, gbrg or bggr");
  command.add_option("--ignore", o.ignore, "R,G,B: pixels of exactly this colour (8 bits) hold no picture");
}

Result<Bracket> read_bracket(const CommonOptions& common, const BracketOptions& o, const TakePicture& take) {
  std::vector<double> times;
  if (!o.exposures.empty()) {
    const auto numbers = parse_numbers(o.exposures, 0, "--exposures");
    if (!numbers)
      return numbers.error();
    times = *numbers;
  }
  std::optional<Rgb> ignore;
  if (!o.ignore.empty()) {
    const auto colour = parse_numbers(o.ignore, 3, "--ignore");
    if (!colour)
      return colour.error();
    ignore = Rgb((*colour)[0], (*colour)[1], (*colour)[2]);
  }
  const auto mosaic = mosaic_named(o.mosaic);
  if (!mosaic)
    return Error{ErrorCode::usage, mosaic.error().what, "--mosaic", mosaic.error().hint};
  auto files = bracket_files(common.inputs, times, o.list);
  if (!files)
    return files.error();
  Bracket bracket{std::move(*files), {}, {}, 0};
  ProgressLine progress(common.quiet || common.json);
  int width = 0, height = 0;
  for (std::size_t i = 0; i < bracket.files.file.size(); ++i) {
    const BracketFile& f = bracket.files.file[i];
    if (!progress.update("pictures", static_cast<double>(i) / static_cast<double>(bracket.files.file.size())))
      return interrupted_error("exposure bracket");
    const auto picture = read_code_picture(f.path, *mosaic);
    if (!picture)
      return picture.error();
    if (const Result<void> good = check_mosaic_given(*picture); !good)
      return good.error();
    if (interrupted())
      return interrupted_error("exposure bracket");
    if (width == 0) {
      width = picture->code.width;
      height = picture->code.height;
      bracket.bits = picture->bits;
    }
    if (picture->code.width != width || picture->code.height != height || picture->bits != bracket.bits) {
      bracket.dropped.push_back(
          {picture->file,
           fmt::format("is {} x {} pixels of {} bits, the shortest exposure {} x {} of {}", picture->code.width,
                       picture->code.height, picture->bits, width, height, bracket.bits)});
      continue;
    }
    if (picture->bits > 16)
      return Error{ErrorCode::value_invalid, "is an HDR picture already", f.path.string(),
                   "a bracket has 8 or 16 bits a code value"};
    const std::vector<std::uint8_t> ignored = pixels_of_colour(picture->code, ignore);
    bracket.places.push_back(place_codes(*picture, f.time, ignored));
    if (take)
      if (const Result<void> taken = take(*picture, f.time, ignored); !taken)
        return taken.error();
  }
  return bracket;
}

Report report_on(const std::string& title, const Bracket& bracket) {
  Report report;
  report.title = title;
  report.dropped = bracket.dropped;
  for (const PlaceCodes& p : bracket.places)
    report.used.push_back(p.file);
  return report;
}

namespace {

/// Whether a picture differs from the one before by less than kAlike nearly everywhere.
bool alike(const PlaceCodes& a, const PlaceCodes& b) {
  std::size_t same = 0;
  for (std::size_t i = 0; i < a.code.size(); ++i) {
    const Rgb off = a.code[i] - b.code[i];
    same += std::max({std::abs(off.r), std::abs(off.g), std::abs(off.b)}) < kAlike ? 1 : 0;
  }
  return static_cast<double>(same) > kNearlyAll * static_cast<double>(a.code.size());
}

} // namespace

std::optional<std::string> no_bracket(const Bracket& bracket) {
  if (bracket.places.empty())
    return "no picture can be used";
  if (bracket.files.different_times() < 2 || bracket.places.size() < 2)
    return fmt::format(
        "one exposure only: {}; take the scene with at least three, one or two stops apart, from a tripod",
        bracket.places.size() == 1 ? "there is a single picture"
                                   : fmt::format("all {} pictures have the same exposure time", bracket.places.size()));
  const auto differs = [](const PlaceCodes& a, const PlaceCodes& b) { return !alike(a, b); };
  if (std::ranges::adjacent_find(bracket.places, differs) == bracket.places.end())
    return "all pictures are alike although their times differ: all black, all white, or one exposure; change the "
           "exposure time of the camera between them";
  return std::nullopt;
}

} // namespace daylit::calibration
