#include "scene/sky/sun_position.h"

#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <optional>
#include <span>

#include <erfa.h>
#include <erfam.h>
#include <fmt/format.h>

namespace daylit {

namespace {

constexpr double kRadians = std::numbers::pi / 180.0;
constexpr double kEarthRadius_au = 6378137.0 / ERFA_DAU; // at the equator, WGS 84

/// Modified Julian Date of the day at 0 h, or nothing where the Gregorian calendar has no such day.
std::optional<double> modified_julian_date(int year, int month, int day) {
  double origin = 0.0, date = 0.0;
  return eraCal2jd(year, month, day, &origin, &date) == 0 ? std::optional(date) : std::nullopt;
}

/// Numbers separated by exactly the given characters; how many were read before the text ended, or -1.
int read_fields(std::string_view text, std::string_view separators, std::span<double> values) {
  std::size_t count = 0;
  while (count < values.size()) {
    const auto [stop, ec] =
        std::from_chars(text.data(), text.data() + text.size(), values[count], std::chars_format::fixed);
    if (ec != std::errc{} || text.front() == '-')
      return -1;
    ++count;
    text.remove_prefix(static_cast<std::size_t>(stop - text.data()));
    if (text.empty())
      return static_cast<int>(count);
    if (count > separators.size() || text.front() != separators[count - 1])
      return -1;
    text.remove_prefix(1);
    if (text.empty())
      return -1;
  }
  return -1;
}

} // namespace

/// Hours as a decimal: h + m/60 + s/3600. A time without a year gets kTypicalYear, or 2000 where it is February 29.
Result<LocalTime> parse_local_time(const std::string& text) {
  const auto error = [&](const char* what) {
    return Error{ErrorCode::value_invalid, what, "time \"" + text + "\"",
                 "write it as \"2021-06-21 12:30\" or \"06-21 12:30\", local standard time"};
  };
  const std::size_t middle = text.find_first_of(" T");
  if (middle == std::string::npos)
    return error("not a date and a time");
  std::array<double, 3> date{}, clock{};
  const int dates = read_fields(std::string_view(text).substr(0, middle), "--", date);
  const int clocks = read_fields(std::string_view(text).substr(middle + 1), "::", clock);
  if (dates < 2 || clocks < 2 || clock[0] != std::floor(clock[0]) || (clocks == 3 && clock[1] != std::floor(clock[1])))
    return error("not a date and a time");
  LocalTime time;
  time.any_year = dates == 2;
  const bool leap_day = dates == 2 && date[0] == 2 && date[1] == 29;
  const std::array<double, 3> ymd =
      dates == 3 ? date : std::array<double, 3>{leap_day ? 2000.0 : LocalTime::kTypicalYear, date[0], date[1]};
  if (!(ymd[0] >= 1900 && ymd[0] <= 2100))
    return error("years are 1900 to 2100");
  if (!(ymd[1] >= 1 && ymd[1] <= 12))
    return error("months are 1 to 12");
  if (ymd[0] != std::floor(ymd[0]) || ymd[1] != std::floor(ymd[1]) || ymd[2] != std::floor(ymd[2]))
    return error("not a date and a time");
  time.year = static_cast<int>(ymd[0]);
  time.month = static_cast<int>(ymd[1]);
  time.day = static_cast<int>(ymd[2]);
  if (!is_day(time))
    return error("there is no such day");
  if (!(clock[0] < 24 && clock[1] < 60 && clock[2] < 60))
    return error("there is no such time of day");
  time.hour = clock[0] + clock[1] / 60.0 + clock[2] / 3600.0;
  return time;
}

std::string time_text(const LocalTime& t) {
  const auto seconds = static_cast<int>(std::lround(t.hour * 3600.0));
  std::string text =
      fmt::format("{:04}-{:02}-{:02} {:02}:{:02}", t.year, t.month, t.day, seconds / 3600, seconds / 60 % 60);
  return seconds % 60 == 0 ? text : text + fmt::format(":{:02}", seconds % 60);
}

bool is_day(const LocalTime& t) { return modified_julian_date(t.year, t.month, t.day).has_value(); }

/// From time and place to the horizon, in the steps of the IAU (McCarthy & Petit, IERS Conventions 2003, ch. 5):
/// direction from the observer in the barycentric frame, annual and diurnal aberration, bias-precession-nutation to the
/// celestial intermediate frame, earth rotation, horizon. No refraction: the pressure given is 0.
SunPosition sun_position(const Place& place, const LocalTime& time) {
  // UTC stands for UT1, which it follows within a second: the earth turns by 0.004 degrees in a second.
  const double utc =
      modified_julian_date(time.year, time.month, time.day).value_or(0.0) + (time.hour - place.time_zone_h) / 24.0;
  eraASTROM a{};
  double origins = 0.0;
  eraApco13(ERFA_DJM0, utc, 0.0, place.longitude_deg * kRadians, place.latitude_deg * kRadians, 0.0, 0.0, 0.0, 0.0, 0.0,
            0.0, 0.55, &a, &origins);

  // From the observer the sun stands at -eh, em astronomical units away: aberration, precession and nutation, horizon.
  double natural[3] = {-a.eh[0], -a.eh[1], -a.eh[2]}, proper[3], intermediate[3];
  eraAb(natural, a.v, a.em, a.bm1, proper);
  eraRxp(a.bpn, proper, intermediate);
  double ascension = 0.0, declination = 0.0, azimuth = 0.0, zenith = 0.0, hour = 0.0, seen_declination = 0.0,
         seen_ascension = 0.0;
  eraC2s(intermediate, &ascension, &declination);
  eraAtioq(ascension, declination, &a, &azimuth, &zenith, &hour, &seen_declination, &seen_ascension);

  SunPosition sun;
  sun.altitude = 0.5 * std::numbers::pi - zenith;
  sun.azimuth = azimuth;
  // From the observer to the centre of the earth along the line of sight, to first order in radius over distance.
  sun.distance = a.em + kEarthRadius_au * std::sin(sun.altitude);
  sun.direction = {std::cos(sun.altitude) * std::sin(sun.azimuth), std::cos(sun.altitude) * std::cos(sun.azimuth),
                   std::sin(sun.altitude)};
  return sun;
}

} // namespace daylit
