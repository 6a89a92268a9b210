#pragma once

// Weather tapes: EnergyPlus .epw and Radiance/DAYSIM .wea. Times are local standard time. A row stands for an interval;
// its time here is the middle of it, where Radiance puts the sun (epw2wea writes hour - 0.5; gendaymtx takes the .wea
// hour as it is).

#include <filesystem>
#include <string>
#include <vector>

#include "scene/core/result.h"
#include "scene/sky/sun_position.h"

namespace daylit {

enum class WeatherUnit {
  irradiance,            ///< direct normal and diffuse horizontal, broadband W/m2 (.epw; .wea unit 1)
  horizontal_irradiance, ///< direct on the horizontal, diffuse horizontal, W/m2 (.wea unit 2)
  illuminance,           ///< direct normal and diffuse horizontal, lx (.wea unit 3)
};

struct WeatherRow {
  LocalTime time; ///< middle of the interval; any_year for .wea
  double direct = 0.0, diffuse = 0.0;
  double dew_point_C = 0.0; ///< NaN where the tape has none
  bool missing = false;     ///< direct or diffuse is not there (9999 in .epw)
  int line = 0;
};

struct WeatherFile {
  std::string name; ///< of the file
  Place place;
  double elevation_m = 0.0;
  WeatherUnit unit = WeatherUnit::irradiance;
  double step_h = 1.0; ///< length of the intervals
  std::vector<WeatherRow> rows;
};

/// Longitude and time zone of a .wea are degrees *west*; they come out east positive like those of an .epw.
/// Error: not such a file, a number that is none or out of its range, with the line.
Result<WeatherFile> parse_epw(std::string_view text, const std::string& name);
Result<WeatherFile> parse_wea(std::string_view text, const std::string& name);
/// By the extension, .epw or .wea; at most 256 MB.
Result<WeatherFile> read_weather(const std::filesystem::path& path);

/// The row whose interval holds the time. Without a year in `time` the first year that has the day. Error: no such row
/// (says what there is), or its radiation is missing.
Result<WeatherRow> weather_at(const WeatherFile& weather, const LocalTime& time);

} // namespace daylit
