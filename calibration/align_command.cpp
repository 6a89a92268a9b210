// daylit-calibrate align: how the sky camera is turned, from the sun at known times or from known points.

#include <cmath>
#include <memory>
#include <numbers>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <nlohmann/json.hpp>

#include "calibration/code_picture.h"
#include "calibration/command.h"
#include "calibration/orientation_fit.h"
#include "calibration/sun_spot.h"
#include "scene/core/read_file.h"
#include "scene/core/text_lines.h"
#include "scene/lens/lens.h"
#include "scene/sky/sun_position.h"

namespace daylit::calibration {

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kTolerance_deg = 1.5;      ///< a sun further off is none
constexpr double kPointTolerance_deg = 3.0; ///< clicked points
constexpr double kLowest_deg = 5.0;         ///< sun's altitude: below, refraction lifts it by more than 0.15 degrees
constexpr std::size_t kFewestSuns = 3, kFewestPoints = 3;
constexpr double kSpread_deg = 20.0, kSure_deg = 0.2, kScatter_deg = 0.6;

struct AlignOptions {
  std::filesystem::path lens, times, landmarks;
  std::string place, position;
  double north_deg = 0.0;
};

/// World of the room from x east, y north, z up: the room's y axis points `north_deg` clockwise from north.
glm::dvec3 room_from_compass(const glm::dvec3& d, double north_deg) {
  const double c = std::cos(north_deg * kDegree), s = std::sin(north_deg * kDegree);
  return {c * d.x - s * d.y, s * d.x + c * d.y, d.z};
}

Result<Place> parse_place(const std::string& text) {
  const auto n = parse_numbers(text, 3, "--place");
  if (!n)
    return n.error();
  if (std::abs((*n)[0]) > 90 || std::abs((*n)[1]) > 180 || std::abs((*n)[2]) > 14)
    return Error{ErrorCode::usage, "'" + text + "' is no place", "--place",
                 "latitude and longitude in degrees (north, east), time zone in hours, as 52.52,13.40,1"};
  return Place{(*n)[0], (*n)[1], (*n)[2]};
}

/// The lines of a file, without comments and empty ones, with their places for messages.
Result<std::vector<std::pair<std::string, std::string>>> lines_of(const std::filesystem::path& path) {
  const auto bytes = read_whole_file(path, std::size_t{1} << 20);
  if (!bytes)
    return bytes.error();
  const std::string text(bytes->begin(), bytes->end());
  std::vector<std::pair<std::string, std::string>> out;
  TextLines lines(text);
  for (std::string_view line; lines.next(line);)
    if (const std::string_view rest = trimmed(line.substr(0, line.find('#'))); !rest.empty())
      out.emplace_back(rest, path.string() + ", line " + std::to_string(lines.number()));
  return out;
}

/// "NAME TIME" per line, in the order of the inputs.
Result<std::vector<LocalTime>> read_times(const CommonOptions& o, const AlignOptions& options) {
  const auto lines = lines_of(options.times);
  if (!lines)
    return lines.error();
  std::vector<LocalTime> times;
  for (const std::filesystem::path& input : o.inputs) {
    const std::string name = input.filename().string();
    bool found = false;
    for (const auto& [line, where] : *lines) {
      std::string_view rest = line;
      if (take_word(rest) != name)
        continue;
      const auto time = parse_local_time(std::string(trimmed(rest)));
      if (!time)
        return Error{ErrorCode::value_invalid, time.error().what, where, time.error().hint};
      times.push_back(*time);
      found = true;
      break;
    }
    if (!found)
      return Error{ErrorCode::value_invalid, "no time for " + name, options.times.string(),
                   "a file name and a time on each line, as sky1.exr 2026-06-21 09:30"};
  }
  return times;
}

/// One for each picture that shows the sun; the others are dropped with the reason.
Result<std::vector<Sighting>> sun_sightings(const CommonOptions& o, const AlignOptions& options, const LensModel& lens,
                                            std::vector<DroppedPicture>& dropped) {
  const auto place = parse_place(options.place);
  if (!place)
    return place.error();
  const auto times = read_times(o, options);
  if (!times)
    return times.error();
  std::vector<Sighting> sightings;
  ProgressLine progress(o.quiet || o.json);
  for (std::size_t i = 0; i < o.inputs.size(); ++i) {
    if (!progress.update("pictures", static_cast<double>(i) / static_cast<double>(o.inputs.size())))
      return interrupted_error("alignment");
    const auto picture = read_code_picture(o.inputs[i]);
    if (!picture)
      return picture.error();
    std::string why;
    const SunPosition sun = sun_position(*place, (*times)[i]);
    if (lens.width_px > 0 && (picture->code.width != lens.width_px || picture->code.height != lens.height_px))
      why = fmt::format("is {} x {} pixels, the lens {} x {}", picture->code.width, picture->code.height, lens.width_px,
                        lens.height_px);
    else if (sun.altitude < kLowest_deg * kDegree)
      why =
          fmt::format("the sun stands at {:.1f} degrees then; too low, or wrong time or place", sun.altitude / kDegree);
    else if (const auto spot = find_sun(picture->code, lens, picture->bits > 16 ? INFINITY : 0.98f, why))
      sightings.push_back({picture->file, spot->direction, room_from_compass(sun.direction, options.north_deg)});
    if (!why.empty())
      dropped.push_back({picture->file, why});
  }
  return sightings;
}

/// "px py x y z [name]" per line.
Result<std::vector<Sighting>> landmark_sightings(const AlignOptions& options, const LensModel& lens,
                                                 std::vector<DroppedPicture>& dropped) {
  const auto position = parse_numbers(options.position, 3, "--position");
  if (!position)
    return position.error();
  const auto lines = lines_of(options.landmarks);
  if (!lines)
    return lines.error();
  std::vector<Sighting> sightings;
  for (const auto& [line, where] : *lines) {
    std::string_view rest = line;
    double n[5];
    for (double& v : n) {
      const auto number = parse_number(take_word(rest));
      if (!number || !std::isfinite(*number))
        return Error{ErrorCode::value_invalid, "not a pixel and a point", where,
                     "px py x y z on each line: where it was clicked, and where it is (metres)"};
      v = *number;
    }
    const std::string name =
        trimmed(rest).empty() ? fmt::format("point {}", sightings.size() + 1) : std::string(trimmed(rest));
    const auto seen = lens.unproject({n[0], n[1]});
    const glm::dvec3 to = glm::dvec3(n[2], n[3], n[4]) - glm::dvec3((*position)[0], (*position)[1], (*position)[2]);
    if (!seen || !(glm::length(to) > 0))
      dropped.push_back({name, seen ? "lies where the camera is" : "lies outside the field of the lens"});
    else
      sightings.push_back({name, *seen, glm::normalize(to)});
  }
  return sightings;
}

std::string figures(const OrientationFit& fit, const std::vector<Sighting>& sightings) {
  nlohmann::ordered_json j;
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

std::vector<std::string> faults_of(const OrientationFit& fit, bool sun) {
  std::vector<std::string> faults;
  if (fit.spread_deg < kSpread_deg)
    faults.push_back(fmt::format("all directions lie within {:.0f} degrees: {}", fit.spread_deg,
                                 sun ? "take pictures some hours apart" : "click points in different directions"));
  if (fit.sigma_deg > kSure_deg)
    faults.push_back(fmt::format("the orientation is only known to {:.2f} degrees; take more {}", fit.sigma_deg,
                                 sun ? "pictures with the sun, at different hours" : "points"));
  if (sun && fit.rms_deg > kScatter_deg)
    faults.push_back(
        fmt::format("the suns are {:.2f} degrees off: wrong clock or place, or not this camera's lens", fit.rms_deg));
  return faults;
}

Result<void> run(CommonOptions& o, const AlignOptions& options) {
  const bool sun = options.landmarks.empty();
  if (sun ? options.place.empty() || options.times.empty() : options.position.empty())
    return Error{ErrorCode::usage, sun ? "needs --place and --times" : "needs --position", "align",
                 "give --place LAT,LON,ZONE and --times FILE for the sun, or --landmarks FILE and --position X,Y,Z"};
  auto lens = read_lens(options.lens);
  if (!lens)
    return lens.error();
  Report report;
  report.title = "Alignment";
  const auto sightings =
      sun ? sun_sightings(o, options, *lens, report.dropped) : landmark_sightings(options, *lens, report.dropped);
  if (!sightings)
    return sightings.error();
  const auto fit =
      fit_orientation(*sightings, sun ? kTolerance_deg : kPointTolerance_deg, sun ? kFewestSuns : kFewestPoints);
  if (!fit)
    return deliver_without_result(
        o, report,
        {fit.error().what +
         (sun ? ": take pictures with the sun at different hours; check time zone (no daylight saving), place and lens"
              : ": check the points, the position and the lens")});
  for (std::size_t i = 0; i < sightings->size(); ++i) {
    if (fit->used[i])
      report.used.push_back((*sightings)[i].name);
    else
      report.dropped.push_back(
          {(*sightings)[i].name,
           fmt::format("{:.1f} degrees from where it should be: {}", fit->error_deg[i],
                       sun ? "not the sun, or a wrong time" : "a wrong click or a wrong measure")});
  }
  lens->world_from_camera = fit->world_from_camera;
  report.figures = figures(*fit, *sightings);
  report.text =
      fmt::format("turn       known to {:.3f} degrees (one standard deviation); {} directions off by {:.3f} rms\n"
                  "spread     {:.0f} degrees; leaving one out turns it by {:.3f} at most\n",
                  fit->sigma_deg, report.used.size(), fit->rms_deg, fit->spread_deg, fit->held_out_deg);
  report.html = page(*fit, *sightings);
  judge(report, faults_of(*fit, sun),
        fmt::format("{} directions agree within {:.2f} degrees; the orientation is known to {:.2f}", report.used.size(),
                    fit->rms_deg, fit->sigma_deg));
  return deliver_result(o, kLensKind, report, [&] { return write_lens(o.output, *lens); });
}

} // namespace

Command add_align_command(CLI::App& app, CommonOptions& o) {
  const auto options = std::make_shared<AlignOptions>();
  CLI::App* command =
      app.add_subcommand("align", "orientation of the sky camera: the sun at known times, or known points");
  add_common_options(*command, o, "pictures of the sky (HDR or 8 bits); with --landmarks the one that was clicked",
                     "the lens file to write: the same lens with world_from_camera");
  command->add_option("--lens", options->lens, "lens file of the camera")->required();
  command->add_option("--place", options->place,
                      "LATITUDE,LONGITUDE,TIME ZONE: degrees north and east, hours from UTC");
  command->add_option("--times", options->times,
                      "text file: picture and local standard time, NAME YYYY-MM-DD HH:MM:SS");
  command->add_option("--north", options->north_deg, "direction of the room's +y axis, degrees clockwise from north");
  command->add_option("--landmarks", options->landmarks,
                      "text file: PX PY X Y Z, pixel and point (metres), three or more");
  command->add_option("--position", options->position, "X,Y,Z of the camera, metres, for --landmarks");
  return {command, [&o, options] { return run(o, *options); }};
}

} // namespace daylit::calibration
