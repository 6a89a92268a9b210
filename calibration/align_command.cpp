// daylit-calibrate align: how the sky camera is turned, from the sun at known times, a marker board or known points.

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "calibration/align_sightings.h"

namespace daylit::calibration {

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kTolerance_deg = 1.5;      ///< a sun further off is none
constexpr double kPointTolerance_deg = 3.0; ///< clicked points
constexpr std::size_t kFewestSuns = 3, kFewestPoints = 3;
constexpr double kBoardScatter_deg = 0.5;
constexpr double kTurnPerMinute_deg = 0.25;
constexpr double kSpread_deg = 20.0, kSure_deg = 0.2, kScatter_deg = 0.6;

std::vector<std::string> night_faults(const Findings& found) {
  if (found.suns_at_night.empty())
    return {};
  return {fmt::format("{}: the sun is seen where it should be below the horizon: wrong times, time zone or place (or a "
                      "lamp: leave these pictures out)",
                      fmt::join(found.suns_at_night, ", "))};
}

/// Clockwise, degrees; from north, where +y of the room lies at `north_deg`.
double azimuth_of(const glm::dvec3& room, double north_deg) {
  return std::fmod(std::atan2(room.x, room.y) / kDegree + north_deg + 720.0, 360.0);
}

std::string figures(const OrientationFit& fit, const std::vector<Sighting>& sightings, const AlignOptions& options,
                    const std::optional<BoardFindings>& board) {
  nlohmann::ordered_json j;
  const glm::dvec3 axis = fit.world_from_camera[2], top = -fit.world_from_camera[1];
  const bool sun = options.source() == Source::sun;
  if (sun)
    j["north_deg"] = options.north_deg;
  j["azimuth_from"] = sun ? "north" : "+y";
  j["axis_azimuth_deg"] = azimuth_of(axis, options.north_deg);
  j["axis_altitude_deg"] = std::asin(std::clamp(axis.z, -1.0, 1.0)) / kDegree;
  j["top_azimuth_deg"] = azimuth_of(top, options.north_deg);
  if (sun)
    j["turn_per_minute_of_clock_deg"] = kTurnPerMinute_deg;
  if (board) {
    j["position"] = {board->position.x, board->position.y, board->position.z};
    j["sigma_m"] = board->sigma_m;
  }
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c)
      j["world_from_camera"].push_back(fit.world_from_camera[c][r]);
  j["sigma_deg"] = fit.sigma_deg;
  j["held_out_deg"] = fit.held_out_deg;
  j["rms_deg"] = fit.rms_deg;
  j["spread_deg"] = fit.spread_deg;
  for (std::size_t i = 0; i < sightings.size(); ++i)
    j["directions"].push_back(
        {{"name", sightings[i].name}, {"off_deg", fit.error_deg[i]}, {"used", static_cast<bool>(fit.used[i])}});
  return j.dump();
}

/// World directions seen from above, and where the camera says they are.
std::string page(const OrientationFit& fit, const std::vector<Sighting>& sightings) {
  std::vector<std::vector<std::string>> rows{{"direction", "off by, degrees", "azimuth", "altitude"}};
  Series known{"known", "#36c", {}, false}, seen{"seen by the camera, turned", "#c60", {}, false};
  const auto azimuth = [](const glm::dvec3& d) { return std::fmod(std::atan2(d.x, d.y) / kDegree + 360.0, 360.0); };
  const auto altitude = [](const glm::dvec3& d) { return std::asin(std::clamp(d.z, -1.0, 1.0)) / kDegree; };
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    const glm::dvec3 turned = fit.world_from_camera * sightings[i].camera;
    known.points.push_back({azimuth(sightings[i].world), altitude(sightings[i].world)});
    seen.points.push_back({azimuth(turned), altitude(turned)});
    rows.push_back({sightings[i].name, fmt::format("{:.3f}{}", fit.error_deg[i], fit.used[i] ? "" : ", not used"),
                    fmt::format("{:.1f}", azimuth(sightings[i].world)),
                    fmt::format("{:.1f}", altitude(sightings[i].world))});
  }
  const Series series[] = {known, seen};
  return html_plot(series, "azimuth from +y clockwise, degrees", "altitude, degrees") + html_table(rows);
}

/// Where the camera looks, so that a person can see whether it does.
std::string look_of(const OrientationFit& fit, const AlignOptions& options) {
  const glm::dvec3 axis = fit.world_from_camera[2], top = -fit.world_from_camera[1];
  std::string text =
      fmt::format("camera     looks towards azimuth {:.0f}, {:.0f} degrees above the horizon; the top of its picture "
                  "towards azimuth {:.0f}\n",
                  azimuth_of(axis, options.north_deg), std::asin(std::clamp(axis.z, -1.0, 1.0)) / kDegree,
                  azimuth_of(top, options.north_deg));
  if (options.source() != Source::sun)
    return text + "           (azimuth clockwise from +y of the room)\n";
  return text +
         fmt::format("           (azimuth clockwise from north, +y of the room at {:g}, --north; compare it with the "
                     "place)\n"
                     "clock      each minute that it is wrong turns the camera by {:g} degrees, which the suns cannot "
                     "show\n",
                     options.north_deg, kTurnPerMinute_deg);
}

std::vector<std::string> faults_of(const OrientationFit& fit, Source source, const Findings& found) {
  const std::optional<BoardFindings>& board = found.board;
  const bool sun = source == Source::sun;
  std::vector<std::string> faults = night_faults(found);
  if (!board && fit.spread_deg < kSpread_deg)
    faults.push_back(fmt::format("all directions lie within {:.0f} degrees: {}", fit.spread_deg,
                                 sun ? "take pictures some hours apart" : "click points in different directions"));
  if (board && board->tilt_uncertain)
    faults.push_back(
        "the tilt of the board is uncertain, it is seen face on or small: hang it closer and oblique, or give "
        "--position");
  if (fit.sigma_deg > kSure_deg)
    faults.push_back(fmt::format("the orientation is only known to {:.2f} degrees; take more {}", fit.sigma_deg,
                                 sun     ? "pictures with the sun, at different hours"
                                 : board ? "pictures of the board, closer, or give --position"
                                         : "points"));
  if (sun && fit.rms_deg > kScatter_deg)
    faults.push_back(
        fmt::format("the suns are {:.2f} degrees off: wrong clock or place, or not this camera's lens", fit.rms_deg));
  if (board && fit.rms_deg > kBoardScatter_deg)
    faults.push_back(
        fmt::format("the corners of the markers are {:.2f} degrees off: wrong size_m or --position, or not "
                    "this camera's lens",
                    fit.rms_deg));
  return faults;
}

Result<void> check_usage(const AlignOptions& options) {
  const Source source = options.source();
  if (source == Source::sun && (options.place.empty() || options.times.empty()))
    return Error{ErrorCode::usage, "needs --place and --times, --board, or --landmarks", "align",
                 "give --place LAT,LON,ZONE and --times FILE for the sun, --board FILE, or --landmarks FILE and "
                 "--position X,Y,Z"};
  if (source == Source::landmarks && options.position.empty())
    return Error{ErrorCode::usage, "needs --position", "align", "where the camera stands, as --position 0,0,1.5"};
  if (!options.landmarks.empty() && !options.board.empty())
    return Error{ErrorCode::usage, "--board and --landmarks", "align", "give one of them"};
  return {};
}

/// What to do where no orientation was found.
const char* advice(Source source) {
  if (source == Source::sun)
    return ": take pictures with the sun at different hours; check time zone (no daylight saving), place and lens";
  return source == Source::board
             ? ": come closer, the side of a marker needs 20 pixels of the picture; or check [marker] of "
               "--board, --position and the lens"
             : ": check the points, the position and the lens";
}

/// Used and dropped directions, figures, text and page.
void describe(const OrientationFit& fit, const std::vector<Sighting>& sightings, const AlignOptions& options,
              const std::optional<BoardFindings>& board, Report& report) {
  const Source source = options.source();
  const char* const wrong = source == Source::sun ? "not the sun, or a wrong time"
                            : board               ? "another marker, or a bent board"
                                                  : "a wrong click or a wrong measure";
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    if (fit.used[i])
      report.used.push_back(sightings[i].name);
    else
      report.dropped.push_back(
          {sightings[i].name, fmt::format("{:.1f} degrees from where it should be: {}", fit.error_deg[i], wrong)});
  }
  report.figures = figures(fit, sightings, options, board);
  report.text =
      fmt::format("turn       known to {:.3f} degrees (one standard deviation); {} directions off by {:.3f} rms\n"
                  "spread     {:.0f} degrees; leaving one out turns it by {:.3f} at most\n",
                  fit.sigma_deg, report.used.size(), fit.rms_deg, fit.spread_deg, fit.held_out_deg);
  if (board && !board->position_given)
    report.text += fmt::format("position   {:.3f} {:.3f} {:.3f}, known to {:.3f} m\n", board->position.x,
                               board->position.y, board->position.z, board->sigma_m);
  report.text += look_of(fit, options);
  report.html = page(fit, sightings) + fmt::format("<pre>{}</pre>\n", html_escaped(report.text));
}

Result<void> run(CommonOptions& o, const AlignOptions& options) {
  if (const Result<void> good = check_usage(options); !good)
    return good;
  const Source source = options.source();
  auto lens = read_lens(options.lens);
  if (!lens)
    return lens.error();
  Report report;
  report.title = "Alignment";
  Findings found;
  const auto sightings = sightings_of(o, options, *lens, found);
  if (!sightings)
    return sightings.error();
  report.dropped = found.dropped;
  auto fit = fit_orientation(*sightings, source == Source::sun ? kTolerance_deg : kPointTolerance_deg,
                             source == Source::sun ? kFewestSuns : kFewestPoints);
  if (!fit && !found.suns_at_night.empty())
    return deliver_without_result(o, report, night_faults(found));
  if (!fit)
    return deliver_without_result(
        o, report,
        {report.dropped.empty() || source == Source::sun || !sightings->empty()
             ? fit.error().what + advice(source)
             : report.dropped.front().file + ": " + report.dropped.front().why + advice(source)});
  if (found.board)
    fit->sigma_deg = std::max(fit->sigma_deg, found.board->sigma_deg);
  lens->world_from_camera = fit->world_from_camera;
  describe(*fit, *sightings, options, found.board, report);
  judge(report, faults_of(*fit, source, found),
        fmt::format("{} directions agree within {:.2f} degrees; the orientation is known to {:.2f}{}",
                    report.used.size(), fit->rms_deg, fit->sigma_deg,
                    source == Source::sun ? ", apart from the clock, --place and --north" : ""));
  return deliver_result(o, kLensKind, report, [&] { return write_lens(o.output, *lens); });
}

} // namespace

Command add_align_command(CLI::App& app, CommonOptions& o) {
  const auto options = std::make_shared<AlignOptions>();
  CLI::App* command = app.add_subcommand(
      "align", "orientation of the sky camera: the sun at known times, a marker board, or known points");
  add_common_options(*command, o, "pictures of the sky (HDR or 8 bits); with --landmarks the one that was clicked",
                     "the lens file to write: the same lens with world_from_camera");
  command->add_option("--lens", options->lens, "lens file of the camera")->required();
  command->add_option("--place", options->place,
                      "LATITUDE,LONGITUDE,TIME ZONE: degrees north and east, hours from UTC");
  command->add_option("--times", options->times,
                      "text file: picture and local standard time, NAME YYYY-MM-DD HH:MM:SS");
  command->add_option("--north", options->north_deg, "direction of the room's +y axis, degrees clockwise from north");
  command->add_option("--board", options->board,
                      "TOML file whose [marker] section says what board the camera sees, and where it hangs");
  command->add_option("--landmarks", options->landmarks,
                      "text file: PX PY X Y Z, pixel and point (metres), three or more");
  command->add_option("--position", options->position,
                      "X,Y,Z of the camera, metres: for --landmarks; with --board the turn is known better");
  return {command, [&o, options] { return run(o, *options); }};
}

} // namespace daylit::calibration
