#include "calibration/align_sightings.h"

#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "calibration/code_picture.h"
#include "calibration/fisheye_board.h"
#include "calibration/sun_spot.h"
#include "capture/hdr/response_curve.h"
#include "scene/config/marker_config.h"
#include "scene/core/read_file.h"
#include "scene/core/text_lines.h"
#include "scene/sky/sun_position.h"

namespace daylit::calibration {

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kLowest_deg = 5.0; ///< sun's altitude: below, refraction lifts it by more than 0.15 degrees
constexpr double kNight_deg = -1.0; ///< below, no refraction lets it be seen

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
                                            Findings& findings) {
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
    else if (const auto spot = find_sun(picture->code, lens, picture->bits > 16 ? INFINITY : 0.98f, why)) {
      if (sun.altitude < kNight_deg * kDegree)
        findings.suns_at_night.push_back(picture->file);
      if (sun.altitude < kLowest_deg * kDegree)
        why = fmt::format("the sun stands at {:.1f} degrees then: too low, or wrong time or place",
                          sun.altitude / kDegree);
      else
        sightings.push_back({picture->file, spot->direction, room_from_compass(sun.direction, options.north_deg)});
    }
    if (!why.empty())
      findings.dropped.push_back({picture->file, why});
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

/// The picture as light.
Result<RgbImage> linear_picture(const std::filesystem::path& path, const LensModel& lens, std::string& why) {
  auto picture = read_code_picture(path);
  if (!picture)
    return picture.error();
  if (lens.width_px > 0 && (picture->code.width != lens.width_px || picture->code.height != lens.height_px))
    why = fmt::format("is {} x {} pixels, the lens {} x {}", picture->code.width, picture->code.height, lens.width_px,
                      lens.height_px);
  if (picture->bits <= 16)
    for (Rgb& texel : picture->code.texels)
      for (int c = 0; c < 3; ++c)
        texel[c] = ResponseCurve::srgb().exposure(texel[c], c);
  return std::move(picture->code);
}

/// The board in every picture that shows it; the others are dropped with the reason.
Result<std::vector<LocatedBoard>> located_boards(const CommonOptions& o, const AlignOptions& options,
                                                 const LensModel& lens, std::vector<DroppedPicture>& dropped) {
  const auto marker = read_marker_config(options.board);
  if (!marker)
    return marker.error();
  const auto board = board_of(*marker);
  if (!board)
    return board.error();
  std::vector<LocatedBoard> found;
  ProgressLine progress(o.quiet || o.json);
  for (std::size_t i = 0; i < o.inputs.size(); ++i) {
    if (!progress.update("pictures", static_cast<double>(i) / static_cast<double>(o.inputs.size())))
      return interrupted_error("alignment");
    std::string why;
    const auto picture = linear_picture(o.inputs[i], lens, why);
    if (!picture)
      return picture.error();
    const auto located = why.empty() ? locate_board(*picture, lens, *board, marker->world_from_board)
                                     : Result<LocatedBoard>(Error{ErrorCode::not_found, why, "", ""});
    if (located)
      found.push_back(*located);
    else if (located.error().code == ErrorCode::not_found)
      dropped.push_back({o.inputs[i].filename().string(), located.error().what});
    else
      return located.error();
  }
  return found;
}

/// Directions to the corners of the markers from the place of the camera: the given one, or the mean of the poses.
Result<std::vector<Sighting>> board_sightings(const CommonOptions& o, const AlignOptions& options,
                                              const LensModel& lens, std::vector<DroppedPicture>& dropped,
                                              BoardFindings& board) {
  const auto found = located_boards(o, options, lens, dropped);
  if (!found)
    return found.error();
  const auto count = static_cast<double>(std::max<std::size_t>(found->size(), 1));
  for (const LocatedBoard& b : *found) {
    board.position += glm::dvec3(b.world_from_camera[3]) / count;
    board.sigma_deg += b.sigma_deg / std::pow(count, 1.5); // independent: the mean falls with the root
    board.sigma_m += b.sigma_m / std::pow(count, 1.5);
    board.tilt_uncertain = board.tilt_uncertain || b.tilt_uncertain;
  }
  if (!options.position.empty()) {
    const auto position = parse_numbers(options.position, 3, "--position");
    if (!position)
      return position.error();
    board = {{(*position)[0], (*position)[1], (*position)[2]}, true, false, 0.0, 0.0};
  }
  std::vector<Sighting> sightings;
  for (std::size_t k = 0; k < found->size(); ++k)
    for (std::size_t i = 0; i < (*found)[k].corner_camera.size(); ++i)
      sightings.push_back({fmt::format("picture {}, marker {}, corner {}", k + 1, (*found)[k].ids[i / 4], i % 4 + 1),
                           (*found)[k].corner_camera[i], glm::normalize((*found)[k].corner_world[i] - board.position)});
  return sightings;
}

} // namespace

Result<std::vector<Sighting>> sightings_of(const CommonOptions& o, const AlignOptions& options, const LensModel& lens,
                                           Findings& findings) {
  if (options.source() == Source::sun)
    return sun_sightings(o, options, lens, findings);
  if (options.source() == Source::landmarks)
    return landmark_sightings(options, lens, findings.dropped);
  return board_sightings(o, options, lens, findings.dropped, findings.board.emplace());
}

} // namespace daylit::calibration
