#include "scene/sky/sun_position.h"

#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <span>

#include <fmt/format.h>

namespace daylit {

namespace {

constexpr double kPi = std::numbers::pi, kRadians = kPi / 180.0;
constexpr double kParallax = 8.794 / 3600.0 * kRadians; // of the sun at 1 au

bool is_leap(int year) { return year % 4 == 0 && (year % 100 != 0 || year % 400 == 0); }

int days_of_month(int year, int month) {
  constexpr std::array<int, 12> kDays{31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
  return kDays[static_cast<std::size_t>(month - 1)] + (month == 2 && is_leap(year) ? 1 : 0);
}

/// Days from 2000 January 1.5 (Meeus, eq. 7.1, Gregorian calendar).
double days_from_j2000(int year, int month, double day) {
  const int y = month > 2 ? year : year - 1, m = month > 2 ? month : month + 12;
  const int century = y / 100;
  return std::floor(365.25 * (y + 4716)) + std::floor(30.6001 * (m + 1)) + day + 2 - century + century / 4 - 1524.5 -
         2451545.0;
}

/// Terrestrial time minus universal time, seconds: parabola through the values of 1900, 2000 and a forecast for 2100
/// of about 200 s (Morrison & Stephenson 2004); the sun moves 0.04 arc seconds per second.
double delta_t(double centuries) { return 64.0 + (centuries > 0.0 ? 36.0 : 67.0) * centuries; }

/// What Venus, Jupiter and the moon add to the longitude of the sun, and a term of long period, degrees (Meeus,
/// Astronomical Formulae for Calculators, 4th ed. 1988, chapter 18).
double perturbation_deg(double days_since_j2000) {
  const double t = (days_since_j2000 + 36525.0) / 36525.0; // centuries from 1900 January 0.5
  const auto wave = [](double deg) { return std::remainder(deg, 360.0) * kRadians; };
  return 0.00134 * std::cos(wave(153.23 + 22518.7541 * t)) + 0.00154 * std::cos(wave(216.57 + 45037.5082 * t)) +
         0.00200 * std::cos(wave(312.69 + 32964.3577 * t)) +
         0.00179 * std::sin(wave(350.74 + 445267.1142 * t - 0.00144 * t * t)) +
         0.00178 * std::sin(wave(231.19 + 20.20 * t));
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
  if (!(ymd[2] >= 1 && ymd[2] <= days_of_month(time.year, time.month)))
    return error("there is no such day");
  time.day = static_cast<int>(ymd[2]);
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

int day_of_year(const LocalTime& time) {
  int day = time.day;
  for (int month = 1; month < time.month; ++month)
    day += days_of_month(time.year, month);
  return day;
}

SunPosition sun_position(const Place& place, const LocalTime& time) {
  const double ut_days =
      days_from_j2000(time.year, time.month, time.day + (time.hour - place.time_zone_h) / 24.0); // UT since J2000
  const double t = (ut_days + delta_t(ut_days / 36525.0) / 86400.0) / 36525.0;                   // centuries, TT

  // Chapter 25: mean longitude and anomaly, equation of the centre, aberration and the main term of the nutation.
  const double mean_longitude = 280.46646 + t * (36000.76983 + t * 0.0003032);
  const double anomaly = (357.52911 + t * (35999.05029 - t * 0.0001537)) * kRadians;
  const double eccentricity = 0.016708634 - t * (0.000042037 + t * 0.0000001267);
  const double centre = (1.914602 - t * (0.004817 + t * 0.000014)) * std::sin(anomaly) +
                        (0.019993 - t * 0.000101) * std::sin(2.0 * anomaly) + 0.000289 * std::sin(3.0 * anomaly);
  const double distance =
      1.000001018 * (1.0 - eccentricity * eccentricity) / (1.0 + eccentricity * std::cos(anomaly + centre * kRadians));
  const double node = (125.04 - 1934.136 * t) * kRadians;
  const double nutation_deg = -0.00478 * std::sin(node);
  const double longitude = (mean_longitude + centre + perturbation_deg(ut_days) - 0.00569 + nutation_deg) * kRadians;
  const double obliquity = (23.4392911 - t * 0.0130042 + 0.00256 * std::cos(node)) * kRadians;

  // Apparent sidereal time (eq. 12.4), then the horizon.
  const double sidereal = 280.46061837 + 360.98564736629 * ut_days + nutation_deg * std::cos(obliquity);
  const double ascension = std::atan2(std::cos(obliquity) * std::sin(longitude), std::cos(longitude));
  const double declination = std::asin(std::sin(obliquity) * std::sin(longitude));
  const double hour = std::remainder(sidereal + place.longitude_deg, 360.0) * kRadians - ascension;
  const double latitude = place.latitude_deg * kRadians;
  const double east = -std::cos(declination) * std::sin(hour);
  const double north =
      std::sin(declination) * std::cos(latitude) - std::cos(declination) * std::sin(latitude) * std::cos(hour);
  const double up =
      std::sin(declination) * std::sin(latitude) + std::cos(declination) * std::cos(latitude) * std::cos(hour);

  SunPosition sun;
  const double geocentric = std::atan2(up, std::hypot(east, north));
  sun.altitude = geocentric - kParallax / distance * std::cos(geocentric);
  sun.azimuth = std::atan2(east, north);
  if (sun.azimuth < 0.0)
    sun.azimuth += 2.0 * kPi;
  sun.distance = distance;
  sun.direction = {std::cos(sun.altitude) * std::sin(sun.azimuth), std::cos(sun.altitude) * std::cos(sun.azimuth),
                   std::sin(sun.altitude)};
  return sun;
}

} // namespace daylit
